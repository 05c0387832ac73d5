#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/loss_text.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/decide/fleet.h"
#include "tuner/decide/hardware.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

struct ChooseArguments {
  std::vector<std::string> runs;
  std::vector<std::string> max_error;
  std::optional<double> max_time_ms{};
  std::string error;
  std::vector<double> weights;
  std::string regret{regret_id(Regret::minimax)};
  std::string scene;
  Names names;
  bool json = false;
};

FleetOptions options_of(const ChooseArguments& arguments, std::span<const FleetRun> runs) {
  FleetOptions options{.budgets = parse_budgets(arguments.max_error),
                       .max_time_ms = arguments.max_time_ms,
                       .error_metric = arguments.error,
                       .regret = find_regret(arguments.regret)};
  if (options.max_time_ms && !(std::isfinite(*options.max_time_ms) && *options.max_time_ms > 0))
    fail_input("--max-time-ms {}: expected a number above 0", *options.max_time_ms);
  const bool needs_budgets = arguments.max_error.empty() && !options.max_time_ms;
  const bool needs_error = arguments.error.empty();
  for (const FleetRun& run : runs) {
    const RunQuestion own = question_of(run.info);
    const bool is_first = &run == runs.data();
    if (needs_error && options.max_time_ms && !is_first && own.error_metric != options.error_metric)
      fail_input("{} and {} have other errors; say which is to be least by --error", runs.front().name, run.name);
    if (needs_error && is_first) options.error_metric = own.error_metric;
    if (needs_budgets && !is_first && budget_texts(own.budgets) != budget_texts(options.budgets))
      fail_input("{} and {} have other budgets; say which hold by --max-error", runs.front().name, run.name);
    if (needs_budgets && is_first) options.budgets = own.budgets;
  }
  return options;
}

std::vector<FleetRun> runs_of(const ChooseArguments& arguments) {
  if (!arguments.weights.empty() && arguments.weights.size() != arguments.runs.size())
    fail_input("--weights: {} given for {} runs", arguments.weights.size(), arguments.runs.size());
  std::vector<FleetRun> runs;
  for (std::size_t i = 0; i < arguments.runs.size(); ++i) {
    FleetRun run = load_fleet_run(arguments.runs[i]);
    if (!arguments.weights.empty()) run.weight = arguments.weights[i];
    if (!(run.weight > 0)) fail_input("--weights {}: expected a number above 0", run.weight);
    if (!arguments.scene.empty())
      std::erase_if(run.rows, [&](const TableRow& row) { return row.scene != arguments.scene; });
    runs.push_back(std::move(run));
  }
  return runs;
}

/// "3.1 % [2.2, 4.0]", or an excess of error, which is exact.
std::string loss_text(const Loss& loss, const FleetOptions& options) {
  if (options.max_time_ms) return fmt::format("+{}", format_number(loss.value));
  return time_loss_text(loss);
}

void print_places(const Fleet& fleet, const FleetOptions& options, const Names& names) {
  const FleetSetting& pick = fleet.settings.front();
  std::vector<std::vector<std::string>> rows = {
      {"", "place", "the pick's time", options.max_time_ms ? options.error_metric : "slower by"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p)
    rows.push_back({column_letter(p), place_text(fleet.places[p], fleet.places), format_time_ns(pick.losses[p].time_ns),
                    loss_text(pick.losses[p], options)});
  put("\n{}\n", columns(rows, "  "));
  for (std::size_t p = 0; p < fleet.places.size(); ++p)
    put("  {}'s own best: {}\n", column_letter(p),
        fleet.own[p].settings == pick.settings ? "the pick" : names.setting(setting_id(fleet.own[p].settings)));
}

void print_transfer(const Fleet& fleet, const FleetOptions& options) {
  std::vector<std::vector<std::string>> rows = {{"best of"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p) rows.front().push_back("on " + column_letter(p));
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    rows.push_back({column_letter(p)});
    for (const std::optional<Loss>& loss : fleet.own[p].losses)
      rows.back().push_back(loss ? loss_text(*loss, options) : "not within, or not measured");
  }
  put("\nWhat it costs to ship the best of one place in another{}:\n{}",
      options.max_time_ms ? ", in " + options.error_metric : "", columns(rows, "  "));
}

/// What the intervals of time know of runs that differ without a cause.
void print_between_runs(const Fleet& fleet, const Paint& paint) {
  std::vector<std::string> unknown;
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const FleetPlace& place = fleet.places[p];
    if (!place.between_runs)
      unknown.push_back(column_letter(p));
    else
      put("{}\n", paint.dim(fmt::format("{}: {} runs; a case shifts by {:.2g} % from one to the next without a cause, "
                                        "which is in the intervals.",
                                        column_letter(p), place.runs.size(), 100 * *place.between_runs)));
  }
  if (!unknown.empty())
    put("{}\n", paint.dim(fmt::format("Of {} there is one run: what shifts a case from run to run is not known there, "
                                      "nor in the intervals. Give two runs of a device.",
                                      fmt::join(unknown, ", "))));
}

void print_fleet(const Fleet& fleet, const FleetOptions& options, const Names& names) {
  const Paint paint = paint_for_stdout();
  const FleetSetting& pick = fleet.settings.front();
  const bool is_minimax = options.regret == Regret::minimax;
  put("One setting for {} places with {}, of {} that were measured in all:\n", fleet.places.size(),
      bounds_text(options), fleet.settings.size());
  put("  {}\n", paint.good(names.setting(setting_id(pick.settings))));
  if (options.max_time_ms)
    put("  {} {} {} beyond each place's own least\n", is_minimax ? "at most" : "on average",
        format_number(pick.combined.value), options.error_metric);
  else
    put("  slower than each place's own best by {} {}\n", is_minimax ? "at most" : "on average",
        loss_text(pick.combined, options));
  if (fleet.ties > 0)
    put("  {}\n", paint.dim(fmt::format("{} others {}", fleet.ties,
                                        options.max_time_ms ? "lose no more error; they are slower"
                                                            : "cannot be told from it: their intervals overlap")));
  print_places(fleet, options, names);
  if (fleet.places.size() > 1) print_transfer(fleet, options);
  put("\n{}\n", paint.dim("A setting for each place by itself would save what the first table's pick loses there."));
  if (options.max_time_ms) return;
  put("{}\n", paint.dim(fmt::format("All intervals together: {:.0f} %.", 100 * options.confidence)));
  print_between_runs(fleet, paint);
}

void choose_command(const ChooseArguments& arguments) {
  const std::vector<FleetRun> runs = runs_of(arguments);
  const FleetOptions options = options_of(arguments, runs);
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
  const CLI::Option* max_time =
      command
          ->add_option("--max-time-ms,--max-time",
                       "bound on frame time that must hold everywhere: then the most accurate")
          ->type_name("MS");
  command->add_option("--error", arguments->error, "with --max-time-ms: what is to be least; default: the runs' error")
      ->type_name("METRIC");
  command->add_option("--weights", arguments->weights, "of the runs, with --regret mean, e.g. 2,1,1")
      ->delimiter(',')
      ->type_name("W,...");
  command->add_option("--regret", arguments->regret, "minimax: the least worst loss | mean: the least weighted mean")
      ->check(CLI::IsMember(regret_ids()))
      ->type_name("RULE")
      ->capture_default_str();
  command->add_option("--scene", arguments->scene, "only this scene of each run");
  add_names_option(*command, arguments->names);
  command->add_flag("--json", arguments->json, "as JSON");
  command->footer(
      "A loss is the time against the fastest that was measured there within the bounds; with a bound on time, the "
      "error\nbeyond the least there. Several runs of a device count as one place, and what shifts a case between them "
      "is in\nthe intervals.\n"
      "Exit code 1 where no setting is within the bounds everywhere.\n"
      "Examples:\n  reliefbench choose out/laptop out/h200 out/phone --max-error 'e_xy.p99<=0.5'\n"
      "  reliefbench choose out/laptop out/laptop_again out/phone --max-time-ms 2 --error flip");
  command->callback([=, &exit_code] {
    if (!max_time->empty()) arguments->max_time_ms = max_time->as<double>();
    choose_command(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
