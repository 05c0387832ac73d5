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
#include "tuner/cli/names.h"
#include "tuner/measure/sweep.h"

namespace reliefbench {
namespace {

struct StressArguments {
  std::string extremes;
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

void print_faults(const StressReport& report, const Names& names, const Paint& paint) {
  int shown = 0;
  int all = 0;
  for (const StressResult& result : report.results) {
    if (result.holds()) continue;
    ++all;
    if (++shown > 20) continue;
    if (result.is_lost) {
      put("{} {} at {}: {}\n", paint.bad("lost "),
          names.setting(fmt::format("{}?{}", result.technique, result.settings)), result.extreme, result.skipped);
      continue;
    }
    std::string broken;
    for (std::size_t i = 0; i < result.faults.size(); ++i)
      if (result.faults.at(i) > 0)
        broken += fmt::format("{}{} {} px", broken.empty() ? "" : ", ", kStressCheckIds.at(i), result.faults.at(i));
    put("{} {} at {} on {}: {} of {} px\n", paint.bad("fails"),
        names.setting(fmt::format("{}?{}", result.technique, result.settings)), result.extreme, result.backend, broken,
        result.pixels);
  }
  if (all > 20) put("... and {} more, all in stress.json\n", all - 20);
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

void stress_command(const StressArguments& arguments, int& exit_code) {
  const Extremes extremes = arguments.extremes.empty() ? built_in_extremes() : load_extremes(arguments.extremes);
  if (!arguments.output.empty()) prepare_stress_folder(arguments.output);  // before the work, not after it
  std::optional<SimulatedFilter> simulated;
  if (!arguments.simulate_filter.empty()) simulated = parse_simulated(arguments.simulate_filter);
  const StressReport report = run_stress(extremes, {.backends = choose_backends(arguments.backend),
                                                    .device = arguments.device,
                                                    .filter = arguments.filter,
                                                    .is_large = arguments.large,
                                                    .simulated = simulated,
                                                    .quiet = arguments.quiet,
                                                    .open = open_isolated});
  if (!arguments.output.empty()) write_stress(report, arguments.output);
  const auto skipped =
      std::ranges::count_if(report.results, [](const auto& r) { return !r.skipped.empty() && !r.is_lost; });
  if (arguments.json) {
    fmt::print("{}\n", stress_json(report).dump(1));
  } else {
    const Paint paint = paint_for_stdout();
    print_matrix(report, paint);
    print_faults(report, arguments.names, paint);
    const auto failing = std::ranges::count_if(report.results, [](const auto& r) { return !r.holds(); });
    put("{} pairs of frames, {} fail, {} left out, {:.0f} s\n",
        static_cast<std::int64_t>(report.results.size()) - skipped, failing, skipped, report.wall_s);
    for (const std::string& device : report.devices) put("{}\n", device);
    if (!arguments.output.empty()) put("report: {}/stress.html\n", arguments.output);
  }
  if (skipped == static_cast<std::int64_t>(report.results.size())) {
    exit_code = static_cast<int>(Exit::nothing_measured);
  } else if (!report.holds()) {
    exit_code = static_cast<int>(Exit::answer_is_no);
  }
}

}  // namespace

void add_stress_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("stress", "every technique, map and format at the extremes: what holds");
  const auto arguments = std::make_shared<StressArguments>();
  command->add_option("EXTREMES", arguments->extremes, "a file of extremes; default: configs/extremes/standard.json");
  command->add_option("-o,--output", arguments->output, "folder for stress.json, stress.html and the worst pictures");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | all")->capture_default_str();
  command->add_option("--device", arguments->device, "index on the backend")->capture_default_str();
  command->add_option("--filter", arguments->filter, "glob over technique/map/format/extreme, e.g. 'cone/*/cliff'");
  command->add_flag("--large", arguments->large, "the extremes with large maps too (most of an hour)");
  command
      ->add_option("--simulate-filter", arguments->simulate_filter,
                   "everything through a sampler whose weights have so many bits, e.g. 8:round or 6:truncate")
      ->type_name("BITS:WAY");
  add_names_option(*command, arguments->names);
  command->add_flag("--quiet", arguments->quiet, "no progress");
  command->add_flag("--json", arguments->json, "all results on standard output");
  command->footer("Example:\n  reliefbench stress --backend all -o out/stress");
  command->callback([arguments, &exit_code] { stress_command(*arguments, exit_code); });
}

}  // namespace reliefbench
