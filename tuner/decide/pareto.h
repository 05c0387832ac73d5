#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/budgets.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// The records of one device and scene (by key), whatever their status. Pointers go into the records that were grouped.
struct RecordGroup {
  std::string backend;
  std::string device;
  std::string scene;
  SceneKey scene_key{};
  std::vector<const Record*> records;
};
/// Sorted by backend, device, scene; records keep their order.
[[nodiscard]] std::vector<RecordGroup> group_records(std::span<const Record> records);

/// One case on a front.
struct FrontPoint {
  const Record* record = nullptr;
  double time_ns = 0;  ///< median
  double error = 0;
  /// Cases off the front that the measurement cannot tell from this point or that are better than it in error: they
  /// meet the constraints too, their error is <= this point's, and their time interval [ci_low, ci_high] overlaps
  /// this point's (shared ends count). A case can stand by several points.
  std::vector<const Record*> equivalents;
};

/// The Pareto front of one device and scene.
struct Front {
  std::string backend;
  std::string device;
  std::string scene;
  SceneKey scene_key{};
  std::string error_metric;
  std::vector<std::string> constraints;  ///< Budget::text()
  std::vector<FrontPoint> points;        ///< by rising time, so falling error
};

/// Points (time, error) that no other strictly dominates: i is out iff some j is <= in both and < in one. Of points
/// equal in both, the first stays. A perfect zero is a value like any other. Indices by rising time. O(n log n).
/// throws: Error(bad_input): a NaN, or spans of different lengths
[[nodiscard]] std::vector<std::size_t> pareto_front(std::span<const double> time, std::span<const double> error);

/// A front for each (backend, device, scene) of the ok records that meet the constraints; empty fronts are kept.
/// throws: Error(bad_input): no such metric, or one where higher is better
[[nodiscard]] std::vector<Front> fronts(std::span<const Record> records, std::string_view error_metric,
                                        std::span<const Budget> constraints);

[[nodiscard]] nlohmann::json fronts_json(std::span<const Front> fronts);  ///< front.json

}  // namespace reliefbench
