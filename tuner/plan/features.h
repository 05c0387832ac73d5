#pragma once
#include <span>
#include <string>
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// What a setting has beyond the plainest trace on an 8-bit height map: "map=relaxed", "correction=safe",
/// "refinement=binary", "filter=manual", "format=rg16f", ... A parameter's first choice is its plain one; of formats
/// those with 8 bits are, of maps the heights themselves. Step counts are no features.
[[nodiscard]] std::vector<std::string> features(const Settings& settings);

/// A setting with its time, as a rung of a ladder.
struct RungCandidate {
  std::size_t index = 0;  ///< the caller's
  std::vector<std::string> features{};
  std::size_t simplicity = 0;  ///< place of its technique in the registry
  double time_ns = 0;          ///< by which it is judged
};
/// From the fewest features to the fastest setting: each rung is the fastest of all with as many features or fewer
/// (ties: the simpler technique). Indices into the candidates. Empty for none.
[[nodiscard]] std::vector<std::size_t> ladder(std::span<const RungCandidate> candidates);

}  // namespace reliefbench
