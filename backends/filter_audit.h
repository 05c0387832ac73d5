#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

/// How exactly a sampler's linear filter weighs, as its own results show it.
struct FilterPrecision {
  int bits = 0;         ///< of the weight: 2^bits steps from one texel to the next, at most kMostFilterBits
  double least = 0;     ///< shown weight less the asked one: the least
  double greatest = 0;  ///< likewise, the greatest
  bool rounds = false;  ///< to the nearest step; otherwise towards the first texel
  /// What the filter may be off by, as a share of the difference of two neighbouring texels.
  [[nodiscard]] double worst() const { return std::max({0.0, -least, greatest}); }
};
inline constexpr int kMostFilterBits = 14;  ///< of the places that the audit asks for: finer steps are not told apart

/// weights: shown for the places i / n, i = 0 .. n - 1, between a texel of 0 and one of 1; n a power of two
[[nodiscard]] FilterPrecision filter_precision(std::span<const float> weights);

/// A kind of texel that a device filters.
struct FilterAudit {
  TexelType type = TexelType::unorm8;
  FilterPrecision precision{};
};

/// Draws two texels of every type that maps are stored in, enlarged by 2^14, and looks at the weights that come out.
/// Some drivers weigh 8-bit texels more coarsely than others, and some more coarsely than they report.
[[nodiscard]] std::vector<FilterAudit> audit_filter(Backend& backend, Dialect dialect);

}  // namespace reliefbench
