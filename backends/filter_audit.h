#pragma once
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

inline constexpr double kGpuFilterError = 0x1p-9;  ///< worst() of GPUs' samplers: weights of 8 bits, rounded

/// How exactly a sampler's linear filter weighs and adds, as its own results show it.
struct FilterPrecision {
  int bits = 0;         ///< of the weight: 2^bits steps from one texel to the next, at most kMostFilterBits
  double least = 0;     ///< shown weight less the asked one: the least
  double greatest = 0;  ///< likewise, the greatest
  bool rounds = false;  ///< to the nearest step; otherwise towards the first texel
  double value = 0;     ///< what a result is off by beside its weights': its own rounding, above a float's
  /// What the filter may be off by, as a share of the difference of two neighbouring texels.
  [[nodiscard]] double worst() const { return std::max({0.0, -least, greatest}); }
  /// Whether that is clearly more than a GPU's.
  [[nodiscard]] bool is_coarse() const { return worst() > 1.5 * kGpuFilterError; }
  /// worst() on the safe side: for places between those that the audit asks for, too.
  [[nodiscard]] FilterError error() const;
};
inline constexpr int kMostFilterBits = 14;  ///< of the places that the audit asks for: finer steps are not told apart

/// weights: shown for the places i / n, i = 0 .. n - 1, between a texel of 0 and one of 1; n a power of two
[[nodiscard]] FilterPrecision filter_precision(std::span<const float> weights);

/// values: shown by a plane of texels, rows and columns of them i / side between `low` and `low` + `step` a texel
/// shift: what the weights are off by, which the values may be, too
/// returns: what they are off by beyond that
[[nodiscard]] double filter_value_error(std::span<const float> values, double low, double step, double shift);

/// A kind of texel, and how a device filters it.
struct FilterAudit {
  TexelType type = TexelType::unorm8;
  FilterPrecision precision{};
  std::string refusal{};  ///< why the device does not; "" where it does
};

/// Draws a few texels of every type that maps are stored in, enlarged by 2^14, and looks at what comes out. Some
/// drivers weigh texels of 8 bits more coarsely than others or than they report, and some round the result.
/// A type whose texture the device refuses does not hide what it makes of the others.
/// simulated: the sampler to look at in place of the device's
[[nodiscard]] std::vector<FilterAudit> audit_filter(Backend& backend, Dialect dialect,
                                                    const SimulatedFilter& simulated = {});

}  // namespace reliefbench
