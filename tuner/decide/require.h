#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace reliefbench {

// What a scene requires: of all that a frame may have, the least whose absence is seen by nobody.

/// Features of a list by its places: bit i is the i-th.
using FeatureSet = std::uint32_t;
[[nodiscard]] bool has(FeatureSet set, std::size_t feature);
[[nodiscard]] int size_of(FeatureSet set);

/// The features of a scene, and which of them frames can have together: a penumbra is none without a shadow.
struct FeatureSpace {
  std::vector<std::string> features;  ///< at most 32
  std::vector<FeatureSet> sets;       ///< each once
};
/// Of the sets within `set` that lack the feature, the largest.
[[nodiscard]] std::optional<FeatureSet> largest_without(const FeatureSpace& space, FeatureSet set, std::size_t feature);
/// Of the sets that hold `set` and the feature, the smallest.
[[nodiscard]] std::optional<FeatureSet> smallest_with(const FeatureSpace& space, FeatureSet set, std::size_t feature);

/// How far the picture of a set is from the full reference, where it is worst. Lower is better.
using SetError = std::function<double(FeatureSet)>;

/// A set that was looked at.
struct JudgedSet {
  FeatureSet set = 0;
  double error = 0;
};

struct Required {
  std::vector<FeatureSet> smallest;  ///< all of the fewest features that were found within the limit; none: no set is
  std::vector<JudgedSet> judged;     ///< in the order in which they were looked at
};
/// Every set is looked at.
[[nodiscard]] Required require_by_enumeration(const FeatureSpace& space, const SetError& error, double limit);
/// From all features downwards, always without the one whose absence is seen least; from none upwards, always with the
/// one that brings most, then downwards again. Looks at about the square of the number of features.
[[nodiscard]] Required require_greedily(const FeatureSpace& space, const SetError& error, double limit);

}  // namespace reliefbench
