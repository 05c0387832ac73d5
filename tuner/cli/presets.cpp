#include "tuner/decide/presets.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/features_option.h"
#include "tuner/cli/format.h"
#include "tuner/cli/loss_text.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/decide/hardware.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

struct PresetsArguments {
  std::vector<std::string> folders;
  std::string output;
  std::string header;
  std::string features;
  PresetQuery query;
  bool common = false;
  std::string regret{regret_id(Regret::minimax)};
  Names names;
  bool json = false;
};

void print_device(const DevicePresets& device, const Presets& presets, const Names& names, const Paint& paint) {
  put("\n{}\n", paint.bold(fmt::format("{}, {}", device.backend, device.device)));
  const std::string scenes = device.scenes.size() == 1 ? fmt::format("1 scene ({})", device.scenes.front().scene)
                                                       : fmt::format("{} scenes", device.scenes.size());
  put("  of {} settings {} were measured in {}, {} of them within the constraints, {} on the front\n", device.measured,
      device.shared, scenes, device.feasible, device.on_front);
  const bool has_two = presets.level_metric != presets.error_metric;
  std::vector<std::vector<std::string>> rows = {{"quality", "x fastest", presets.level_metric}};
  if (has_two) rows[0].push_back(presets.error_metric);
  rows[0].emplace_back("setting");
  for (const PresetLevel& level : device.levels) {
    const Record& record = *level.evidence.front().record;
    std::vector<std::string>& row = rows.emplace_back();
    row = {fmt::format("{}", level.quality), fmt::format("{:.2f}", level.relative_time),
           format_number(level.level_error)};
    if (has_two) row.push_back(format_number(level.error));
    row.push_back(fmt::format("{}{}", names.setting(record.case_id), coarse_mark(level)));
  }
  put("{}", columns(rows, "  "));
}

void print_common(const Presets& presets, const Names& names, const Paint& paint) {
  const CommonPresets& common = *presets.common;
  put("\n{}\n",
      paint.bold(fmt::format("One table for {} places; slower than each one's own best that is as accurate by",
                             common.places.size())));
  std::vector<std::vector<std::string>> rows = {{"quality", presets.level_metric}};
  for (std::size_t p = 0; p < common.places.size(); ++p) {
    put("  {}: {}\n", column_letter(p), place_text(common.places[p], common.places));
    rows.front().push_back(column_letter(p));
  }
  rows.front().emplace_back("setting");
  for (const CommonLevel& level : common.levels) {
    std::vector<std::string>& row = rows.emplace_back();
    row = {fmt::format("{}", level.quality), format_number(level.level_error)};
    for (const Loss& loss : level.losses) row.push_back(time_loss_text(loss));
    row.push_back(
        fmt::format("{}{}", names.setting(setting_id(level.losses.front().row->settings)), coarse_mark(level.losses)));
  }
  put("{}", columns(rows, "  "));
  put("{}\n", paint.dim("The intervals of a level hold together, 95 %."));
}

void presets_command(const PresetsArguments& arguments) {
  std::vector<Run> runs;
  for (const std::string& folder : arguments.folders) {
    runs.push_back(load_run(folder));
    if (!arguments.features.empty()) keep_features(runs.back().records, arguments.features, folder);
  }
  std::vector<FleetRun> fleet;
  if (arguments.common)
    for (const Run& run : runs) fleet.push_back(fleet_run(run));
  const Presets presets = arguments.common
                              ? make_common_presets(runs, fleet, arguments.query, find_regret(arguments.regret))
                              : make_presets(runs, arguments.query);
  const std::string text = json_text(presets_json(presets), 1) + "\n";
  write_output(arguments.output, text);
  if (!arguments.header.empty()) write_output(arguments.header, presets_header(presets));
  for (const std::string& warning : presets.warnings) print_warning(warning);
  if (arguments.json) {
    fmt::print("{}", text);
    return;
  }
  const Paint paint = paint_for_stdout();
  if (presets.common)
    print_common(presets, arguments.names, paint);
  else
    for (const DevicePresets& device : presets.devices) print_device(device, presets, arguments.names, paint);
  for (const std::string& note : coarse_notes(presets)) put("\n{}\n", paint.dim(note));
  put("\nwritten: {}{}{}\n", arguments.output, arguments.header.empty() ? "" : ", ", arguments.header);
}

}  // namespace

void add_presets_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("presets", "a table of quality levels for each device, from finished runs");
  const auto arguments = std::make_shared<PresetsArguments>();
  command
      ->add_option("RUN", arguments->folders,
                   "folders of runs: of two measurements of a setting the later folder's counts")
      ->required();
  command->add_option("-o,--output", arguments->output, "file to write, e.g. presets.json")->required();
  command->add_option("--header", arguments->header, "also as `#define`s for C++ and GLSL, e.g. presets.h");
  command
      ->add_option("--error", arguments->query.error_metric,
                   "metric of the error, and of the levels' spacing; default: the runs', and FLIP's")
      ->type_name("METRIC");
  add_bounds_option(*command, "--constraint", arguments->query.constraints,
                    "bound that every level keeps, e.g. 'e_xy.p99<=2'; may be repeated; default: the constraints and "
                    "the budgets of the runs");
  CLI::Option* common =
      command->add_flag("--common", arguments->common, "one table for all devices of the runs, with its price on each");
  command->add_option("--regret", arguments->regret, "with --common: minimax (the least worst price) | mean; minimax")
      ->check(CLI::IsMember(regret_ids()))
      ->type_name("RULE")
      ->needs(common);
  add_features_option(*command, arguments->features);
  add_names_option(*command, arguments->names);
  command->add_flag("--json", arguments->json, "print it as JSON");
  command->footer(
      "Level 0 is the cheapest setting within the runs' budgets, level 100 the most accurate as far as is seen; "
      "between\n"
      "them are equal steps of visible error, FLIP or the logarithm of --error. Levels that would be the same are "
      "left\n"
      "out: whoever asks for one gets the next lower. With several scenes a setting counts as in its worst one.\n"
      "A config can sweep the levels:\n"
      "  {\"presets\": \"presets.json\", \"quality\": [0, 50, 100]}\n"
      "Exit code 1 where no setting meets the constraints in all scenes.\n"
      "Example:\n"
      "  reliefbench presets out/quickstart -o presets.json --header presets.h\n"
      "  reliefbench presets out/rocks out/bricks -o presets.json\n"
      "  reliefbench presets out/laptop out/desktop --common -o presets.json");
  command->callback([arguments] { presets_command(*arguments); });
}

}  // namespace reliefbench
