#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace reliefbench {

/// Standard deviation of the noise, from first differences: a step is in one of them only. The MAD; where more than
/// half of them are 0 (a coarse clock), the mean absolute difference. 0 where there are under two values.
[[nodiscard]] double difference_sigma(std::span<const double> values);

/// Values that stand alone: further than 4 sigma from the median of the 2 * least - 1 values round them, so that fewer
/// than `least` values in a row do. Indices.
/// least_sigma: what sigma is at least
[[nodiscard]] std::vector<std::size_t> lone_values(std::span<const double> values, std::size_t least,
                                                   double least_sigma);

/// The indices under n that are not among these, which rise.
[[nodiscard]] std::vector<std::size_t> all_but(std::span<const std::size_t> lone, std::size_t n);

/// Values as levels with autoregressive noise about them.
///
/// Starts from the optimal partition at a lenient penalty, its noise from first differences. Then noise and
/// autocorrelation are estimated from what is left about the levels, and the weakest step is taken out for as long as
/// it is too weak for that noise. Autocorrelation makes levels of its own and hides in them; as they go, it shows.
/// source: Jackson et al., "An algorithm for optimal partitioning of data on an interval", 2005; Killick et al.,
/// "Optimal detection of changepoints with a linear computational cost", 2012
class LevelFit {
 public:
  /// values: without spikes; least: of a level; least_sigma: of the noise, above 0
  LevelFit(std::span<const double> values, std::size_t least, double least_sigma);

  /// Takes steps out, the weakest first, until all that are left have at least this gain.
  void keep_gains_of(double least_gain);
  /// The largest gain at which keep_gains_of() would leave a step; 0 where there is none. Leaves one level.
  [[nodiscard]] double strongest_gain();

  [[nodiscard]] std::span<const std::size_t> starts() const { return starts_; }  ///< of levels; the first is 0
  [[nodiscard]] std::size_t end(std::size_t level) const;
  [[nodiscard]] double mean(std::size_t level) const;
  [[nodiscard]] double mean_variance(std::size_t level) const;  ///< of the level's mean
  /// Of the step into a level, 1 or later: (difference of means)^2 / its variance.
  [[nodiscard]] double gain(std::size_t level) const;

  /// Where a level may start by the data, 95 %: all nights whose likelihood ratio to the best is within the quantile.
  /// source: Hansen, "Sample splitting and threshold estimation", 2000, theorem 1
  struct Range {
    std::size_t first = 0;
    std::size_t last = 0;
  };
  [[nodiscard]] Range start_range(std::size_t level) const;

  [[nodiscard]] double sigma() const;
  [[nodiscard]] double autocorrelation() const { return rho_; }
  [[nodiscard]] int df() const;  ///< of sigma

 private:
  void propose();
  void split_once();
  void estimate_noise();
  void remove_weakest();
  [[nodiscard]] std::size_t weakest() const;
  [[nodiscard]] std::size_t best_split(std::size_t first, std::size_t end) const;
  [[nodiscard]] double split_score(std::size_t first, std::size_t at, std::size_t end) const;
  [[nodiscard]] double sum(std::size_t first, std::size_t end) const { return sums_[end] - sums_[first]; }

  std::size_t least_;
  double least_sigma_;
  std::vector<double> values_;  // less their median
  double centre_ = 0;
  std::vector<double> sums_;  // of the values before
  std::vector<std::size_t> starts_;
  double variance_ = 0;
  std::vector<double> level_variances_;  // at least variance_: a level may be noisier
  double rho_ = 0;
  double df_ = 1;
};

/// How much more the mean of m values varies than if they were independent, at autocorrelation rho^lag.
[[nodiscard]] double mean_inflation(std::size_t m, double rho);

}  // namespace reliefbench
