#include "tuner/measure/stress.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "backends/filter_audit.h"
#include "backends/worker/remote.h"
#include "kernels/base/error.h"
#include "reports/pages/stress_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/interrupt.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/measure/sweep.h"

namespace reliefbench {
namespace {

struct StressArguments {
  std::string extremes;
  int random = 0;
  std::uint64_t seed = 1;
  std::string output;
  std::string backend = "all";
  int device = 0;
  std::string filter;
  bool large = false;
  std::string simulate_filter;
  Names names;
  bool quiet = false;
  bool json = false;
};

/// All results of one technique at one extreme.
struct Cell {
  int runs = 0;
  int skipped = 0;
  int lost = 0;
  bool is_guaranteed = false;
  std::int64_t faults = 0;
  double missed_rate = 0;  ///< worst
  const StressResult* worst = nullptr;
};

std::map<std::pair<std::string, std::string>, Cell> cells_of(const StressReport& report) {
  std::map<std::pair<std::string, std::string>, Cell> cells;
  for (const StressResult& result : report.results) {
    Cell& cell = cells[{result.technique, result.extreme}];
    if (!result.skipped.empty()) {
      ++(result.is_lost ? cell.lost : cell.skipped);
      continue;
    }
    ++cell.runs;
    cell.is_guaranteed |= result.guarantee != Guarantee::none;
    cell.missed_rate = std::max(cell.missed_rate, result.missed_rate);
    for (const std::int64_t faults : result.faults) cell.faults += faults;
    if (!result.holds() && cell.worst == nullptr) cell.worst = &result;
  }
  return cells;
}

std::string cell_text(const Cell& cell, const Paint& paint) {
  if (cell.lost > 0) return paint.bad(fmt::format("LOST {}", cell.lost));
  if (cell.runs == 0) return paint.dim(cell.skipped > 0 ? "-" : "");
  if (cell.faults > 0) return paint.bad(fmt::format("FAILS {}", cell.faults));
  if (cell.is_guaranteed) return paint.good("held");
  return cell.missed_rate > 0 ? fmt::format("{:.1f}%", 100 * cell.missed_rate) : "ok";
}

void print_matrix(const StressReport& report, const Paint& paint) {
  const auto cells = cells_of(report);
  std::vector<std::vector<std::string>> rows{{""}};
  for (const std::string& technique : report.techniques) rows[0].push_back(paint.bold(technique));
  for (const Extreme& extreme : report.extremes) {
    std::vector<std::string> row{extreme.id};
    for (const std::string& technique : report.techniques) {
      const auto found = cells.find({technique, extreme.id});
      row.push_back(found == cells.end() ? "" : cell_text(found->second, paint));
    }
    rows.push_back(std::move(row));
  }
  put("{}\n", columns(rows));
  put("held: all checks, and what some of the settings guarantee; ok: all\n"
      "checks, nothing missed; a share: all checks, this much of the worst frame missed (no guarantee is broken);\n"
      "-: left out\n");
}

/// What broke; `paint` of the first word.
std::string fault_line(const StressResult& result, const Names& names, const Paint& paint) {
  const std::string setting = names.setting(fmt::format("{}?{}", result.technique, result.settings));
  if (result.is_lost)
    return fmt::format("{} {} at {}: {}", paint.bad("lost "), setting, result.extreme, result.skipped);
  std::string broken;
  for (std::size_t i = 0; i < result.faults.size(); ++i)
    if (result.faults.at(i) > 0)
      broken += fmt::format("{}{} {} px", broken.empty() ? "" : ", ", kStressCheckIds.at(i), result.faults.at(i));
  return fmt::format("{} {} at {} on {}: {} of {} px", paint.bad("fails"), setting, result.extreme, result.backend,
                     broken, result.pixels);
}

void print_faults(const StressReport& report, const Names& names, const Paint& paint) {
  constexpr int kMostShown = 20;
  int all = 0;
  for (const StressResult& result : report.results)
    if (!result.holds() && ++all <= kMostShown) put("{}\n", fault_line(result, names, paint));
  if (all > kMostShown) put("... and {} more, all in stress.json\n", all - kMostShown);
}

/// "6" and "6:round", or "6:truncate".
SimulatedFilter parse_simulated(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string way = text.substr(std::min(colon + 1, text.size()));
  SimulatedFilter simulated{.rounds = way != "truncate"};
  const char* const end = text.data() + colon;
  const auto [parsed, error] = std::from_chars(text.data(), end, simulated.bits);
  const bool is_way = colon == text.size() || way == "round" || way == "truncate";
  if (error != std::errc() || parsed != end || simulated.bits < 1 || simulated.bits > kMostFilterBits || !is_way)
    fail_input("--simulate-filter: '{}' is not BITS:round or BITS:truncate with 1 to {} bits", text, kMostFilterBits);
  return simulated;
}

Extremes extremes_of(const StressArguments& arguments) {
  if (arguments.random > 0) return random_extremes(arguments.random, arguments.seed);
  return arguments.extremes.empty() ? built_in_extremes() : load_extremes(arguments.extremes);
}

Exit exit_of(const StressReport& report) {
  const auto fails = [](const StressResult& result) { return !result.holds(); };
  const auto is_left_out = [](const StressResult& result) { return result.holds() && !result.skipped.empty(); };
  if (std::ranges::any_of(report.results, fails)) return Exit::answer_is_no;
  if (report.undone > 0) return Exit::inconclusive;
  return std::ranges::all_of(report.results, is_left_out) ? Exit::nothing_measured : Exit::done;
}

Exit stress_command(const StressArguments& arguments) {
  const Extremes extremes = extremes_of(arguments);
  std::optional<SimulatedFilter> simulated;
  if (!arguments.simulate_filter.empty()) simulated = parse_simulated(arguments.simulate_filter);
  heed_interrupts();
  std::optional<FolderLock> lock;  // until all is written
  const auto words = [&](const StressResult& result) { return fault_line(result, arguments.names, Paint(false)); };
  const StressReport report = run_stress(extremes, {.backends = choose_backends(arguments.backend),
                                                    .device = arguments.device,
                                                    .filter = arguments.filter,
                                                    .is_large = arguments.large,
                                                    .simulated = simulated,
                                                    .quiet = arguments.quiet,
                                                    .open = open_isolated,
                                                    .draws_at_once = true,
                                                    .words = words,
                                                    .before_drawing =
                                                        [&] {
                                                          if (!arguments.output.empty())
                                                            lock.emplace(prepare_stress_folder(arguments.output));
                                                        },
                                                    .is_interrupted = is_interrupted});
  if (!arguments.output.empty()) write_stress(report, arguments.output);
  const auto skipped =
      std::ranges::count_if(report.results, [](const auto& r) { return !r.skipped.empty() && !r.is_lost; });
  if (arguments.json) {
    print_json(stress_json(report), 1);
  } else {
    const Paint paint = paint_for_stdout();
    print_matrix(report, paint);
    print_faults(report, arguments.names, paint);
    const auto failing = std::ranges::count_if(report.results, [](const auto& r) { return !r.holds(); });
    put("{} pairs of frames, {} fail, {} left out, {:.0f} s\n",
        static_cast<std::int64_t>(report.results.size()) - skipped, failing, skipped, report.wall_s);
    if (report.undone > 0) put("interrupted: {} settings at extremes were not drawn\n", report.undone);
    for (const std::string& device : report.devices) put("{}\n", device);
    if (!arguments.output.empty()) put("report: {}/stress.html\n", arguments.output);
  }
  return exit_of(report);
}

}  // namespace

void add_stress_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("stress", "every technique, map and format at the extremes: what holds");
  const auto arguments = std::make_shared<StressArguments>();
  CLI::Option* const file = command->add_option("EXTREMES", arguments->extremes,
                                                "a file of extremes; default: configs/extremes/standard.json");
  CLI::Option* const random =
      command->add_option("--random", arguments->random, "instead, so many scenes drawn at random")
          ->type_name("N")
          ->check(CLI::Range(1, 10000))
          ->excludes(file);
  command->add_option("--seed", arguments->seed, "of the scenes; scene I is extreme SEED_I, whatever N")
      ->capture_default_str()
      ->needs(random);
  command->add_option("-o,--output", arguments->output, "folder for stress.json, stress.html and the worst pictures");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | all")->capture_default_str();
  add_device_option(*command, arguments->device);
  command->add_option("--filter", arguments->filter, "glob over technique/map/format/extreme, e.g. 'cone/*/cliff'");
  command->add_flag("--large", arguments->large, "the extremes with large maps too (most of an hour)");
  command
      ->add_option("--simulate-filter", arguments->simulate_filter,
                   "everything through a sampler whose weights have so many bits, e.g. 8:round or 6:truncate")
      ->type_name("BITS:WAY");
  add_names_option(*command, arguments->names);
  add_quiet_option(*command, arguments->quiet);
  command->add_flag("--json", arguments->json, "all results on standard output");
  command->footer(
      "Ctrl-C, SIGTERM and SIGHUP (a closed terminal) end it with what was drawn.\n"
      "Example:\n  reliefbench stress --backend all -o out/stress");
  command->callback([arguments, &exit_code] { exit_code = stress_command(*arguments); });
}

}  // namespace reliefbench
