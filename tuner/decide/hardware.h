#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "tuner/decide/compare.h"
#include "tuner/decide/fleet_run.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// One device of a hardware comparison, with the runs that measured it.
struct DeviceColumn {
  MeasuredDevice device;
  std::vector<std::size_t> runs;       ///< indices
  std::size_t cases = 0;               ///< measured: settings times scenes
  std::optional<double> between_runs;  ///< deviation, of a log, of what shifts a case from run to run; none: one run
};

/// The geometric mean of several cases' ratios of frame time, second device / first.
struct PairGroup {
  std::string group;  ///< "all", "technique=cone", "map=relaxed", "format=rg8"
  std::size_t cases = 0;
  RatioInterval ratio;  ///< of just these cases; with the shift between runs of a device where it is known
  double low_case = 1;  ///< nine in ten of the single ratios lie between these
  double high_case = 1;
};

/// A setting in a scene, on both devices of a pair.
struct PairCase {
  std::string setting;  ///< setting_id()
  std::string scene;
  RatioInterval ratio;  ///< by itself, not corrected for the count of cases
  double base_ns = 0;
  double now_ns = 0;
};

/// How far two devices put the settings of a scene into one order.
struct RankCorrelation {
  std::string scene;
  std::size_t cases = 0;
  double rho = 0;  ///< Spearman's
  double low = 0;
  double high = 0;
};

struct DevicePair {
  std::size_t base = 0;  ///< columns
  std::size_t now = 0;
  std::vector<PairGroup> groups;  ///< "all" first
  std::vector<PairCase> cases;    ///< least ratio first
  std::vector<RankCorrelation> ranks;
};

/// A setting that is on some device's front.
struct FrontSetting {
  Settings settings;
  std::vector<double> errors;         ///< parallel to the columns of its scene
  std::vector<const TableRow*> rows;  ///< likewise: of the column's first run that has it; they point into its rows
  /// Parallel to these columns: how much slower than the fastest that is as accurate, as a share; 0: it is on the
  /// front; none: it misses the constraints there.
  std::vector<std::optional<double>> behind;
  std::vector<bool> on_front;
  std::vector<bool> may_be;  ///< ... or nothing is faster by more than its and that one's intervals
};

/// The fronts of one scene, of the settings that all of its columns measured.
struct SceneFronts {
  std::string scene;
  std::vector<std::size_t> columns;
  std::size_t settings = 0;           ///< in common
  std::vector<FrontSetting> on_some;  ///< by rising time on the first column
};

struct HardwareComparison {
  std::vector<DeviceColumn> columns;
  std::vector<DevicePair> pairs;  ///< of one backend; of all where backends are compared
  std::vector<SceneFronts> fronts;
  std::vector<EnvironmentDifference> environment;  ///< parallel to the columns
  std::vector<std::string> warnings;
};

struct HardwareOptions {
  std::string error_metric = "e_xy.p99";  ///< of the fronts
  std::vector<Budget> constraints{};      ///< of the fronts
  bool across_backends = false;  ///< pairs of different backends, too; taken for granted where there are no others
  double confidence = 0.95;      ///< of each interval by itself
};

/// Devices, drivers or backends beside each other: cases match by setting and scene key; where one of two
/// tables does not know its key, by the scene's name.
/// throws: Error(bad_input): all runs are of one device; a metric where higher is better
[[nodiscard]] HardwareComparison compare_hardware(std::span<const FleetRun> runs, const HardwareOptions& options);

/// 0; 5 where no case matches.
[[nodiscard]] Exit exit_of(const HardwareComparison& comparison);

/// What the marks at the settings of fronts mean: of errors that rest on a coarse sampler.
[[nodiscard]] std::set<std::string> coarse_notes(const HardwareComparison& comparison);

[[nodiscard]] nlohmann::json hardware_json(const HardwareComparison& comparison, std::span<const FleetRun> runs);

/// "A vulkan NVIDIA H200": what a column is called in texts.
[[nodiscard]] std::string column_text(const HardwareComparison& comparison, std::size_t column);
/// "A", "B", ...
[[nodiscard]] std::string column_letter(std::size_t column);

/// Spearman's rank correlation, ties by their mean rank, with the interval of Bonett and Wright.
/// source: Bonett & Wright, "Sample size requirements for estimating Pearson, Kendall and Spearman correlations", 2000
/// a, b: of equal length; under four values the interval is [-1, 1]
[[nodiscard]] RankCorrelation rank_correlation(std::span<const double> a, std::span<const double> b, double confidence);

}  // namespace reliefbench
