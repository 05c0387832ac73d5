#pragma once
#include <span>
#include <vector>

namespace reliefbench {

/// An estimate with its error.
struct Estimate {
  double value = 0;
  double variance = 0;
  double df = 0;  ///< of the variance
};

/// How far an estimate is above the least of its group.
struct LossInterval {
  double value = 0;
  double low = 0;
  double high = 0;
};

/// Losses of all estimates of all groups against the least true value of their own group, with intervals that hold all
/// at once.
///
/// Only differences to the truly least one count, which are as many as there are estimates. With a critical value c
/// such that all of these lie within c of their standard errors with the confidence asked, the least is among those
/// that no other one is below by more than that; each loss then lies within what its differences to these candidates
/// allow. c takes into account that the differences of a group share the least one's error.
/// source: Hsu, "Multiple Comparisons: Theory and Methods", 1996, chapter 4 (multiple comparisons with the best)
/// returns: parallel to the groups
[[nodiscard]] std::vector<std::vector<LossInterval>> losses_to_best(std::span<const std::vector<Estimate>> groups,
                                                                    double confidence);

}  // namespace reliefbench
