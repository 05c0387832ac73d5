#pragma once
#include <span>
#include <vector>

namespace reliefbench {

/// Median with a distribution-free 95 % confidence interval (order statistics); n may be small: the interval is then
/// the whole range.
struct Summary {
  double median = 0;
  double mad = 0;  ///< median absolute deviation, unscaled
  double ci_low = 0;
  double ci_high = 0;
  int n = 0;
};
[[nodiscard]] double median(std::span<const double> values);  ///< values not empty
[[nodiscard]] Summary summarise(std::span<const double> values);

/// Two-sided Mann-Whitney U test, exact for small samples without ties, normal approximation with tie correction else.
[[nodiscard]] double mann_whitney_p(std::span<const double> a, std::span<const double> b);

/// Holm's step-down correction: adjusted p-values, same order.
[[nodiscard]] std::vector<double> holm(std::span<const double> p_values);

/// Ratio median(b) / median(a) with a confidence interval by seeded percentile bootstrap at the given level.
struct RatioInterval {
  double ratio = 1;
  double low = 1;
  double high = 1;
};
[[nodiscard]] RatioInterval ratio_interval(std::span<const double> a, std::span<const double> b, double confidence);

[[nodiscard]] double geometric_mean(std::span<const double> values);

}  // namespace reliefbench
