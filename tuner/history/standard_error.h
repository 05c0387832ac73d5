#pragma once
#include <span>
#include <vector>

namespace reliefbench {

/// Standard error of the logarithm of a median of n values that scatter by `mad` round `median`: that of a normal
/// sample's median, sqrt(pi/2) sigma / sqrt(n), with sigma = 1.4826 mad / median. 0 where n < 2
[[nodiscard]] double log_median_error(double median, double mad, int n);

/// A median with what it is made of.
struct RobustMedian {
  double median = 0;
  double mad = 0;
  int n = 0;
};
/// log_median_error() of each, where the scatter of few values borrows strength from that of all: their variances are
/// moderated (statistics.h, VariancePrior), so that three samples that happen to agree are not taken for certain.
[[nodiscard]] std::vector<double> moderated_errors(std::span<const RobustMedian> medians);

}  // namespace reliefbench
