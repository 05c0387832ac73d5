#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/decide/fleet.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

struct ChooseArguments {
  std::vector<std::string> runs;
  std::vector<std::string> max_error;
  std::vector<double> weights;
  std::string regret = "minimax";
  std::string scene;
  Names names;
  bool json = false;
};

/// The budgets that a run was made with; those of a table are the defaults.
std::vector<Budget> own_budgets(const std::string& run) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(run, ignored)) return Config{}.budgets;
  return question_of(load_run(run)).budgets;
}

std::vector<Budget> budgets_of(const ChooseArguments& arguments) {
  if (!arguments.max_error.empty()) return parse_budgets(arguments.max_error);
  std::vector<Budget> first = own_budgets(arguments.runs.front());
  for (const std::string& run : arguments.runs)
    if (budget_texts(own_budgets(run)) != budget_texts(first))
      fail_input("{} and {} have other budgets; say which hold by --max-error", arguments.runs.front(), run);
  return first;
}

std::vector<FleetRun> runs_of(const ChooseArguments& arguments) {
  if (!arguments.weights.empty() && arguments.weights.size() != arguments.runs.size())
    fail_input("--weights: {} given for {} runs", arguments.weights.size(), arguments.runs.size());
  std::vector<FleetRun> runs;
  for (std::size_t i = 0; i < arguments.runs.size(); ++i) {
    FleetRun run{.name = arguments.runs[i], .rows = load_case_table(arguments.runs[i])};
    if (!arguments.weights.empty()) run.weight = arguments.weights[i];
    if (!(run.weight > 0)) fail_input("--weights {}: expected a number above 0", run.weight);
    if (!arguments.scene.empty())
      std::erase_if(run.rows, [&](const TableRow& row) { return row.scene != arguments.scene; });
    runs.push_back(std::move(run));
  }
  return runs;
}

std::string loss_text(const Loss& loss) {
  return fmt::format("{:.1f} % [{:.1f}, {:.1f}]", 100 * loss.value, 100 * loss.low, 100 * loss.high);
}

/// "A", "B", ...: what a place is called in the table of them all.
std::string letter_of(std::size_t place) {
  return place < 26 ? std::string(1, static_cast<char>('A' + place)) : std::to_string(place);
}

void print_places(const Fleet& fleet, const Names& names) {
  const FleetSetting& pick = fleet.settings.front();
  std::vector<std::vector<std::string>> rows = {{"", "place", "the pick's time", "slower by", "own best"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p)
    rows.push_back(
        {letter_of(p), place_text(fleet.places[p]), format_time_ns(pick.losses[p].time_ns), loss_text(pick.losses[p]),
         fleet.own[p].settings == pick.settings ? "the pick" : names.setting(setting_id(fleet.own[p].settings))});
  put("\n{}", columns(rows, "  "));
}

void print_transfer(const Fleet& fleet) {
  std::vector<std::vector<std::string>> rows = {{"best of"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p) rows.front().push_back("on " + letter_of(p));
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    rows.push_back({letter_of(p)});
    for (const std::optional<Loss>& loss : fleet.own[p].losses)
      rows.back().push_back(loss ? loss_text(*loss) : "not within, or not measured");
  }
  put("\nWhat it costs to ship the best of one place in another:\n{}", columns(rows, "  "));
}

void print_fleet(const Fleet& fleet, const FleetOptions& options, const Names& names) {
  const Paint paint = paint_for_stdout();
  const FleetSetting& pick = fleet.settings.front();
  put("One setting for {} places with {}, of {} that were measured in all:\n", fleet.places.size(),
      fmt::join(budget_texts(options.budgets), " and "), fleet.settings.size());
  put("  {}\n  slower than each place's own best by {} {}\n", paint.good(names.setting(setting_id(pick.settings))),
      options.regret == Regret::minimax ? "at most" : "on average", loss_text(pick.combined));
  if (fleet.ties > 0)
    put("  {}\n", paint.dim(fmt::format("{} others cannot be told from it: their intervals overlap", fleet.ties)));
  print_places(fleet, names);
  if (fleet.places.size() > 1) print_transfer(fleet);
  put("\n{}\n", paint.dim(fmt::format("All intervals together: {:.0f} %. A setting for each place by itself would save "
                                      "what the second table's pick loses there.",
                                      100 * options.confidence)));
}

void choose_command(const ChooseArguments& arguments) {
  const FleetOptions options{.budgets = budgets_of(arguments),
                             .regret = arguments.regret == "mean" ? Regret::mean : Regret::minimax};
  const std::vector<FleetRun> runs = runs_of(arguments);
  const Fleet fleet = choose_for_fleet(runs, options);
  if (arguments.json)
    fmt::print("{}\n", fleet_json(fleet, runs, options).dump(2));
  else
    print_fleet(fleet, options, arguments.names);
}

}  // namespace

void add_choose_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("choose", "one setting for several devices and scenes, and what each loses");
  const auto arguments = std::make_shared<ChooseArguments>();
  command->add_option("RUNS", arguments->runs, "run folders, or their table.csv, of the devices")
      ->expected(1, -1)
      ->required();
  command
      ->add_option("--max-error", arguments->max_error, "bound that must hold everywhere; default: the runs' budgets")
      ->type_name("METRIC<=X");
  command->add_option("--weights", arguments->weights, "of the runs, with --regret mean, e.g. 2,1,1")
      ->delimiter(',')
      ->type_name("W,...");
  command->add_option("--regret", arguments->regret, "minimax: the least worst loss | mean: the least weighted mean")
      ->check(CLI::IsMember({"minimax", "mean"}))
      ->type_name("RULE")
      ->capture_default_str();
  command->add_option("--scene", arguments->scene, "only this scene of each run");
  add_names_option(*command, arguments->names);
  command->add_flag("--json", arguments->json, "as JSON");
  command->footer(
      "A loss is the time against the fastest that was measured there within the bounds.\n"
      "Exit code 1 where no setting is within the bounds everywhere.\n"
      "Example:\n  reliefbench choose out/laptop out/h200 out/phone --max-error 'e_xy.p99<=0.5'");
  command->callback([arguments, &exit_code] {
    choose_command(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
