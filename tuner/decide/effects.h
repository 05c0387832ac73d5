#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/results/record.h"
#include "tuner/results/statistics.h"

namespace reliefbench {

/// What a step along one axis of the space does on a device, all else equal: over pairs of cases of one scene and
/// technique that differ in nothing but this parameter.
struct AxisEffect {
  std::string backend;
  std::string device;
  std::string axis;             ///< a parameter; "format, encoding" where both differ, as configs often link them
  std::string from;             ///< the choice that stands earlier in the parameter's row; "n" of a count of steps
  std::string to;               ///< the later one; "2n" of a count
  bool prices_feature = false;  ///< a feature of the scene is on instead of off
  std::size_t pairs = 0;
  Summary time{};  ///< of to / from over the pairs: median, and its interval of order statistics
  /// Parallel to metrics(): the same of a metric's values, where lower is better and some pair has both. A value under
  /// kLeastError counts as that, so that exact ones have a ratio.
  std::vector<std::optional<Summary>> errors{};
};
inline constexpr double kLeastError = 1e-6;

/// Parameters that mean something in only one setting of a pair (binary_steps, where refinement is the axis) are free.
/// Of counts of steps, pairs are those where one has twice the other's. The intervals take pairs to be independent;
/// those that share a case are a little less.
/// returns: by device and axis, then in the order of the axis's choices; of ok records only
/// throws: Error(bad_input): a setting that this registry does not know
[[nodiscard]] std::vector<AxisEffect> axis_effects(std::span<const Record> records);

}  // namespace reliefbench
