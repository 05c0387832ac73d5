#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/config.h"
#include "tuner/record.h"

namespace reliefbench {

/// One case on a front.
struct FrontPoint {
  const Record* record = nullptr;
  double time_ns = 0;
  double error = 0;
  std::vector<const Record*> equivalents;  ///< off the front, but no worse in error and overlapping in time interval
};

/// The Pareto front of one device and scene.
struct Front {
  std::string backend;
  std::string device;
  std::string scene;
  std::string error_metric;
  std::vector<FrontPoint> points;  ///< by rising time, so falling error
};

/// Points (time, error) that no other strictly dominates: i is out iff some j is <= in both and < in one. Of points
/// equal in both, the first stays. A perfect zero is a value like any other. Indices by rising time.
[[nodiscard]] std::vector<std::size_t> pareto_front(std::span<const double> time, std::span<const double> error);

/// A front for each (backend, device, scene) of the ok records that meet the constraints.
[[nodiscard]] std::vector<Front> fronts(std::span<const Record> records, std::string_view error_metric,
                                        std::span<const Budget> constraints);

/// A metric's value; nothing where the record has none (not ok, or psnr of identical pictures).
[[nodiscard]] std::optional<double> metric_value(const Record& record, std::string_view metric_id);
/// Whether the record meets the budget; for higher-is-better metrics the limit is a least value, and a missing psnr
/// (identical pictures) meets it.
[[nodiscard]] bool meets(const Record& record, const Budget& budget);

[[nodiscard]] nlohmann::json fronts_json(std::span<const Front> fronts);  ///< front.json

}  // namespace reliefbench
