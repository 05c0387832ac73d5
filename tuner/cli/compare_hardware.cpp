#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/console.h"
#include "tuner/cli/compare_print.h"
#include "tuner/cli/format.h"
#include "tuner/decide/compare_text.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostExtremes = 3;    // of a pair, at either end, unless --all
constexpr std::size_t kMostFrontRows = 12;  // of a scene, unless --all

std::string ratio_text(const RatioInterval& ratio) {
  return fmt::format("{} [{}, {}]", format_number(ratio.ratio), format_number(ratio.low), format_number(ratio.high));
}

void print_columns(const HardwareComparison& comparison, std::span<const FleetRun> runs) {
  for (std::size_t c = 0; c < comparison.columns.size(); ++c) {
    const DeviceColumn& column = comparison.columns[c];
    std::vector<std::string> names;
    for (const std::size_t run : column.runs) names.push_back(runs[run].name);
    put("{}: {} cases, {}\n", column_text(comparison, c), column.cases, fmt::join(names, " and "));
  }
}

void print_pair_cases(const DevicePair& pair, const CompareDetail& detail) {
  const std::size_t n = pair.cases.size();
  const bool is_whole = detail.all || n <= 2 * kMostExtremes;
  std::vector<std::vector<std::string>> rows = {{"ratio", column_letter(pair.base), column_letter(pair.now), "case"}};
  for (std::size_t i = 0; i < n; ++i) {
    if (!is_whole && i == kMostExtremes) i = n - kMostExtremes;
    const PairCase& one = pair.cases[i];
    rows.push_back({ratio_text(one.ratio), format_time_ns(one.base_ns), format_time_ns(one.now_ns),
                    fmt::format("{} in {}", detail.names.setting(one.setting), one.scene)});
  }
  put("  {}\n{}", is_whole ? "its cases:" : "least and greatest ratios (--all: every case):", columns(rows, "  "));
}

void print_pair(const DevicePair& pair, const HardwareComparison& comparison, const CompareDetail& detail,
                const Paint& paint) {
  const PairGroup& whole = pair.groups.front();
  const bool is_faster = whole.ratio.ratio < 1;
  const double times = is_faster ? 1 / whole.ratio.ratio : whole.ratio.ratio;
  put("\n{}\n", paint.bold(fmt::format("{} against {}: {} times as {}, geometric mean of {} cases",
                                       column_letter(pair.now), column_text(comparison, pair.base),
                                       format_number(times), is_faster ? "fast" : "slow", whole.cases)));
  std::vector<std::vector<std::string>> rows = {
      {fmt::format("time {} / {}", column_letter(pair.now), column_letter(pair.base)), "nine in ten cases", "cases",
       "of"}};
  for (const PairGroup& group : pair.groups)
    rows.push_back({ratio_text(group.ratio),
                    fmt::format("{} to {}", format_number(group.low_case), format_number(group.high_case)),
                    fmt::format("{}", group.cases), group.group});
  put("{}", columns(rows, "  "));
  for (const RankCorrelation& rank : pair.ranks)
    put("  order of the settings in {}: rank correlation {:.3f} [{:.3f}, {:.3f}] of {}\n", rank.scene, rank.rho,
        rank.low, rank.high, rank.cases);
  print_pair_cases(pair, detail);
}

void print_fronts(const SceneFronts& scene, const CompareDetail& detail, const Paint& paint) {
  const auto on_all = std::ranges::count_if(scene.on_some, [](const FrontSetting& one) {
    return std::ranges::all_of(one.on_front, [](bool is_on) { return is_on; });
  });
  const auto only_one = std::ranges::count_if(
      scene.on_some, [](const FrontSetting& one) { return std::ranges::count(one.on_front, true) == 1; });
  put("\n{}\n", paint.bold(fmt::format("Fronts in {}, of {} settings in common: {} on every front, {} on one only",
                                       scene.scene, scene.settings, on_all, only_one)));
  std::vector<std::vector<std::string>> rows = {{}};
  for (const std::size_t column : scene.columns) rows.front().push_back("on " + column_letter(column));
  rows.front().emplace_back("setting");
  const std::size_t shown = detail.all ? scene.on_some.size() : std::min(scene.on_some.size(), kMostFrontRows);
  for (std::size_t i = 0; i < shown; ++i) {
    std::vector<std::string>& row = rows.emplace_back();
    for (std::size_t c = 0; c < scene.columns.size(); ++c) row.push_back(front_text(scene.on_some[i], c));
    row.push_back(detail.names.setting(setting_id(scene.on_some[i].settings)));
  }
  put("{}", columns(rows, "  "));
  if (shown < scene.on_some.size()) put("  ... and {} more (--all)\n", scene.on_some.size() - shown);
}

void print_differences(const HardwareComparison& comparison) {
  if (comparison.environment.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"environment"}};
  for (std::size_t c = 0; c < comparison.columns.size(); ++c) rows.front().push_back(column_letter(c));
  for (const EnvironmentDifference& difference : comparison.environment) {
    std::vector<std::string>& row = rows.emplace_back();
    row.push_back(difference.what);
    for (const std::string& value : difference.values) row.push_back(value.empty() ? "(not recorded)" : value);
  }
  put("\n{}", columns(rows));
}

void print_unknown_shift(const HardwareComparison& comparison, const Paint& paint) {
  std::vector<std::string> unknown;
  for (std::size_t c = 0; c < comparison.columns.size(); ++c)
    if (!comparison.columns[c].between_runs) unknown.push_back(column_letter(c));
  put("\n{}\n", paint.dim("Intervals: 95 %, each by itself; of a mean over cases: of just these cases. (?): what is as "
                          "accurate is not faster as far as can be told."));
  if (!unknown.empty())
    put("{}\n", paint.dim(fmt::format("Of {} there is one run: what shifts a device or a case from run to run is not "
                                      "known there, nor in the intervals. Give two runs of a device.",
                                      fmt::join(unknown, ", "))));
}

}  // namespace

void print_hardware(const HardwareComparison& comparison, std::span<const FleetRun> runs, const CompareDetail& detail) {
  const Paint paint = paint_for_stdout();
  print_columns(comparison, runs);
  for (const DevicePair& pair : comparison.pairs) print_pair(pair, comparison, detail, paint);
  for (const SceneFronts& scene : comparison.fronts)
    if (scene.settings > 0) print_fronts(scene, detail, paint);
  for (const std::string& note : coarse_notes(comparison)) put("\n{}\n", paint.dim(note));
  print_differences(comparison);
  if (comparison.pairs.empty())
    print_error("no setting was measured in one scene on two of the devices: nothing is compared");
  else
    print_unknown_shift(comparison, paint);
}

}  // namespace reliefbench
