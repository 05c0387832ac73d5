#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/fleet_text.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/decide/fleet.h"
#include "tuner/results/budgets.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

struct ChooseArguments {
  std::vector<std::string> runs;
  std::vector<Budget> max_error;
  std::optional<double> max_time_ms{};
  std::string error;
  std::vector<double> weights;
  std::string regret{regret_id(Regret::minimax)};
  std::string scene;
  Names names;
  bool json = false;
};

FleetOptions options_of(const ChooseArguments& arguments, std::span<const FleetRun> runs) {
  FleetOptions options{.budgets = arguments.max_error,
                       .max_time_ms = arguments.max_time_ms,
                       .error_metric = arguments.error,
                       .regret = find_regret(arguments.regret)};
  if (arguments.error.empty()) {
    options.error_metric = question_of(runs.front().info).error_metric;
    for (const FleetRun& run : runs)
      if (options.max_time_ms && question_of(run.info).error_metric != options.error_metric)
        fail_input("{} and {} have other errors; say which is to be least by --error", runs.front().name, run.name);
  }
  if (!arguments.max_error.empty()) return options;
  options.budgets = common_budgets(runs);
  if (options.max_time_ms) options.budgets = budgets_beside(options.error_metric, options.budgets);
  return options;
}

std::vector<FleetRun> runs_of(const ChooseArguments& arguments) {
  if (!arguments.weights.empty() && arguments.weights.size() != arguments.runs.size())
    fail_input("--weights: {} given for {} runs", arguments.weights.size(), arguments.runs.size());
  std::vector<FleetRun> runs;
  std::set<std::string> scenes;
  for (std::size_t i = 0; i < arguments.runs.size(); ++i) {
    FleetRun run = load_fleet_run(arguments.runs[i]);
    if (!arguments.weights.empty()) run.weight = arguments.weights[i];
    for (const TableRow& row : run.rows) scenes.insert(row.scene);
    if (!arguments.scene.empty())
      std::erase_if(run.rows, [&](const TableRow& row) { return row.scene != arguments.scene; });
    runs.push_back(std::move(run));
  }
  if (!arguments.scene.empty() && !scenes.contains(arguments.scene))
    fail_scene(arguments.scene, scenes, "the runs", true);
  return runs;
}

void choose_command(const ChooseArguments& arguments) {
  const std::vector<FleetRun> runs = runs_of(arguments);
  const FleetOptions options = options_of(arguments, runs);
  const Fleet fleet = choose_for_fleet(runs, options);
  for (const std::string& text : fleet.repeated) print_error(text);
  if (arguments.json)
    print_json(fleet_json(fleet, runs, options), 2);
  else
    print_fleet(fleet, options, arguments.names);
}

}  // namespace

void add_choose_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("choose", "one setting for several devices and scenes, and what each loses");
  const auto arguments = std::make_shared<ChooseArguments>();
  command->add_option("RUNS", arguments->runs, "run folders, or their table.csv, of the devices")
      ->expected(1, -1)
      ->required();
  add_bounds_option(*command, "--max-error", arguments->max_error,
                    "bound that must hold everywhere; default: the runs' budgets, with --max-time-ms those that are "
                    "not on the error itself")
      ->type_name("METRIC<=X");
  command
      ->add_option("--max-time-ms,--max-time", arguments->max_time_ms,
                   "bound on frame time that must hold everywhere: then the most accurate")
      ->type_name("MS")
      ->check(above_zero());
  command->add_option("--error", arguments->error, "with --max-time-ms: what is to be least; default: the runs' error")
      ->type_name("METRIC");
  add_weights_option(*command, arguments->weights, "of the runs, with --regret mean, e.g. 2,1,1");
  command->add_option("--regret", arguments->regret, "minimax: the least worst loss | mean: the least weighted mean")
      ->check(CLI::IsMember(regret_ids()))
      ->type_name("RULE")
      ->capture_default_str();
  command->add_option("--scene", arguments->scene, "only this scene of each run");
  add_names_option(*command, arguments->names);
  add_json_option(*command, arguments->json);
  command->footer(
      "A loss is the time against the fastest that was measured there within the bounds; with a bound on time, the "
      "error\nbeyond the least there. Several runs of a device count as one place, and what shifts a case between them "
      "is in\nthe intervals; bounds hold in each of them, and a measurement that two of them hold counts once.\n"
      "Exit code 1 where no setting is within the bounds everywhere, 5 where nothing was measured in a place.\n"
      "Examples:\n  reliefbench choose out/laptop out/h200 out/phone --max-error 'e_xy.p99<=0.5'\n"
      "  reliefbench choose out/laptop out/laptop_again out/phone --max-time-ms 2 --error flip");
  command->callback([arguments] { choose_command(*arguments); });
}

}  // namespace reliefbench
