#include "tuner/decide/presets.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "kernels/base/atomic_file.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/results/case_table.h"

namespace reliefbench {
namespace {

struct Arguments {
  std::vector<std::string> folders;
  std::string output;
  std::string header;
  PresetQuery query;
  bool json = false;
};

void print_device(const DevicePresets& device, const Presets& presets, const Paint& paint) {
  fmt::print("\n{}\n", paint.bold(fmt::format("{}, {}", device.backend, device.device)));
  const std::string scenes = device.scenes.size() == 1 ? fmt::format("1 scene ({})", device.scenes.front().scene)
                                                       : fmt::format("{} scenes", device.scenes.size());
  fmt::print("  of {} settings {} were measured in {}, {} of them within the constraints, {} on the front\n",
             device.measured, device.shared, scenes, device.feasible, device.on_front);
  std::vector<std::vector<std::string>> rows = {{"quality", "x fastest", presets.error_metric, "setting"}};
  for (const PresetLevel& level : device.levels) {
    const Record& record = *level.evidence.front().record;
    rows.push_back({fmt::format("{}", level.quality), fmt::format("{:.2f}", level.relative_time),
                    format_number(level.error),
                    fmt::format("{} {}", record.technique, settings_of(record.technique, record.params).text())});
  }
  fmt::print("{}", columns(rows, "  "));
}

void run(const Arguments& arguments) {
  std::vector<Run> runs;
  for (const std::string& folder : arguments.folders) runs.push_back(load_run(folder));
  const Presets presets = make_presets(runs, arguments.query);
  const std::string text = presets_json(presets).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  write_output(arguments.output, text);
  if (!arguments.header.empty()) write_output(arguments.header, presets_header(presets));
  if (arguments.json) {
    fmt::print("{}", text);
    return;
  }
  const Paint paint = paint_for_stdout();
  for (const DevicePresets& device : presets.devices) print_device(device, presets, paint);
  fmt::print("\nwritten: {}{}{}\n", arguments.output, arguments.header.empty() ? "" : ", ", arguments.header);
}

}  // namespace

void add_presets_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("presets", "a table of quality levels for each device, from finished runs");
  const CLI::Option* folders = command->add_option("RUN", "folders of runs")->required()->expected(1, -1);
  const CLI::Option* output = command->add_option("-o,--output", "file to write, e.g. presets.json")->required();
  const CLI::Option* header = command->add_option("--header", "also as `#define`s for C++ and GLSL, e.g. presets.h");
  const CLI::Option* error =
      command->add_option("--error", "metric of the error; default: the runs'")->type_name("METRIC");
  const CLI::Option* constraints =
      command
          ->add_option("--constraint",
                       "bound that every setting keeps, e.g. 'missed_rate<=0.001'; may be repeated; "
                       "default: the runs'")
          ->type_name("BOUND")
          ->expected(1)
          ->take_all();
  const CLI::Option* json = add_switch(*command, "--json", "print it as JSON");
  command->footer(
      "Level 0 is the cheapest setting of the front, level 100 the most accurate; between them each level may take\n"
      "so many times longer than the one before. With several scenes a setting counts as in its worst one.\n"
      "A config can sweep the levels:\n"
      "  {\"presets\": \"presets.json\", \"quality\": [0, 50, 100]}\n"
      "Exit code 1 where no setting meets the constraints in all scenes.\n"
      "Example:\n"
      "  reliefbench presets out/quickstart -o presets.json --header presets.h");
  command->callback([=, &exit_code] {
    Arguments arguments{.folders = folders->as<std::vector<std::string>>(),
                        .output = output->as<std::string>(),
                        .header = value_or(header, std::string()),
                        .query = {},
                        .json = is_set(json)};
    if (!error->empty()) arguments.query.error_metric = error->as<std::string>();
    if (!constraints->empty()) arguments.query.constraints = parse_budgets(constraints->as<std::vector<std::string>>());
    run(arguments);
    exit_code = 0;
  });
}

}  // namespace reliefbench
