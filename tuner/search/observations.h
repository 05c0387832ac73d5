#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "tuner/search/space.h"

namespace reliefbench {

inline constexpr int kBlock = 3;  ///< frames of a setting in one round, interleaved with those of other settings

/// What was drawn of one setting, on the scale of log ns.
struct Observed {
  std::vector<double> frames{};       ///< log time of every frame, by rising time
  std::vector<std::size_t> blocks{};  ///< the block that each of them is of
  std::vector<double> pairs{};        ///< how many pairs of frames of two other blocks it is the middle of
  std::vector<double> medians{};      ///< of every block, by rising time
  std::vector<double> fastest{};      ///< frame of every block, by rising time
  int order = -1;                     ///< how many settings were timed before it; -1 where not timed
  double mean = 0;                    ///< estimate of the log median of three frames, see NoiseModel
  double clipped = 0;                 ///< the same with slow outliers pulled in, see NoiseModel

  double plain = 0;   ///< mean_median() of the frames as they are
  double across = 0;  ///< median_across_blocks() of the frames as they are, from three blocks on

  void add(const std::array<double, kBlock>& block);
  [[nodiscard]] bool is_measured() const { return !frames.empty(); }
  [[nodiscard]] int count() const { return static_cast<int>(medians.size()); }  ///< of blocks
};

/// Draws the next block of every candidate, their frames in turn: a candidate's are never drawn one after the other
/// unless it is alone. throws: Error(bad_input): a time that is not a positive number
void draw_round(TimeSource& times, std::span<const std::size_t> candidates, std::span<Observed> observed);

/// Mean over all triples of values of the triple's median, after values are pulled into [low, high]: the U-statistic of
/// the median of three. Of independent values it is unbiased for the expectation of their median, and no worse than the
/// mean over disjoint triples, of which it is the average over all orders. values: three or more, sorted
/// source: Hoeffding, "A class of statistics with asymptotically normal distribution", 1948; and "Probability
/// inequalities for sums of bounded random variables", 1963, section 5
[[nodiscard]] double mean_median(std::span<const double> values, double low, double high);
/// Of one value's share in it, its first-order projection: the mean's variance is about variance / n.
[[nodiscard]] double median_variance(std::span<const double> values, double low, double high);
/// Mean of the median over all triples of frames that are of three blocks, after frames are pulled into [low, high]. Of
/// independent blocks it is unbiased for the expected median of three independent frames, however closely a block's
/// frames are tied: two of one block, which slow moments hit together, are never two of the three.
/// observed: of three blocks or more
[[nodiscard]] double median_across_blocks(const Observed& observed, double low, double high);
/// Mean over all pairs of frames of two blocks of the lesser (or the greater), which is no more (no less) than their
/// median with any third: what two blocks alone say. observed: of two blocks
[[nodiscard]] double lesser_across_blocks(const Observed& observed, double low, double high);
[[nodiscard]] double greater_across_blocks(const Observed& observed, double low, double high);
/// Mean of the triple's median given that one of the triple is values[i], for every i: Hajek's projection.
[[nodiscard]] std::vector<double> median_projection(std::span<const double> values);

}  // namespace reliefbench
