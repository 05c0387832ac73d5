#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "tuner/search/space.h"

namespace reliefbench {

/// What was drawn of one setting, on the scale of log ns.
struct Observed {
  std::vector<double> frames;  ///< log time of every frame, by rising time
  int order = -1;              ///< how many settings were timed before it; -1 where not timed
  double mean = 0;             ///< estimate of the expected log median of a block, see MedianStatistic
  double clipped = 0;          ///< the same with slow outliers pulled in, see NoiseModel

  [[nodiscard]] bool is_measured() const { return !frames.empty(); }
  [[nodiscard]] int blocks() const;
};

/// Draws the next block of kBlock frames.
/// throws: Error(bad_input): a time that is not a positive number
void draw_block(TimeSource& times, std::size_t candidate, Observed& observed);

/// Mean over all triples of values of the triple's median, and the variance of its first-order projection.
/// The mean is the U-statistic of the median of three: unbiased for the expectation of a block's median, and no worse
/// than the mean over disjoint blocks, of which it is the average over all orders of the values.
/// source: Hoeffding, "A class of statistics with asymptotically normal distribution", 1948; and "Probability
/// inequalities for sums of bounded random variables", 1963, section 5
struct MedianStatistic {
  double mean = 0;
  double variance = 0;  ///< of one value's share: the mean's variance is about variance / n
};
/// values: three or more, sorted
[[nodiscard]] MedianStatistic median_statistic(std::span<const double> values);
/// Mean of the triple's median given that one of the triple is values[i], for every i: Hajek's projection.
[[nodiscard]] std::vector<double> median_projection(std::span<const double> values);

}  // namespace reliefbench
