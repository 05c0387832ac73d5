#pragma once
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "tuner/search/observations.h"
#include "tuner/search/rank_bound.h"

namespace reliefbench {

/// How far the estimate of a setting's log time may be from its expectation, at every count of blocks at once.
///
/// What is estimated is the expected log median of three independent frames of a setting: a property of the
/// distribution of one frame, whatever ties frames together. Frames are drawn in blocks of kBlock, one block of a
/// setting in a round, and **one block is one observation**: its frames may be tied as closely as they like.
///
/// Let y be a block's statistic, mu its expectation, s the scale of the setting's frames and psi a bound with
/// E exp(l (y - mu) / s) <= exp(psi(l)). The mixture sum_j w_j exp(l_j S_k - k psi(l_j)), S_k = sum (y - mu) / s, is a
/// non-negative supermartingale of mean <= 1. By Ville's inequality it ever exceeds 1 / alpha with probability <=
/// alpha, so that |mean - mu| <= s r(k) for all k at once, where r(k) solves mixture = 1 / alpha: an anytime-valid
/// confidence sequence, however the next setting is chosen. With psi(l) = l^2 / 2 it is the normal mixture but for the
/// grid. source: Howard, Ramdas, McAuliffe & Sekhon, "Time-uniform, nonparametric, nonasymptotic confidence sequences",
/// 2021. The estimate is the mean over triples of frames of three blocks (median_across_blocks): two frames of one
/// block, which slow moments hit together, would make it too large. psi is that of a block's median, from kLinear
/// blocks on that of the block's share in the statistic's first-order projection: what the projection leaves out is not
/// in the bound, and falls with the square of the blocks. Of two blocks the lesser (greater) of pairs bounds the
/// median.
///
/// Correlation is paid for twice over. psi is the cumulant function of whole blocks as they were drawn, pooled over
/// settings and standardised: what ties a block's frames together is in it. And the intraclass correlation is estimated
/// from above (correlation.h), so that the scale has as many degrees of freedom as frames are worth, and outliers count
/// as so many.
///
/// What is assumed, not proven: blocks of one setting are independent. The search sees to it as far as it can: frames
/// of a round are interleaved over its settings, no setting's frames follow each other (rounds.h), and its rounds are
/// spread over those of others; what slows the machine for longer is for the control case to correct. s^2 is the
/// variance of clipped frames within a setting, pooled over settings of similar time (fast ones are noisier), and the
/// setting's own shrunk towards that. psi has one frame more extreme than any seen added at either end; while blocks
/// are few, it is no less than the normal one.
///
/// Slow outliers (another process takes a core for a time slice: a frame, or a whole block, takes several times as
/// long) have no useful psi. One block therefore gives no bound at all. From two on the ranks of the blocks' fastest
/// frames and of their medians say where most of the setting's frames begin (rank_bound.h): most blocks would have to
/// be held up, in all or most of their frames, which as many as were seen of all settings make unlikely; it is assumed
/// that no setting is held up more than kProne times as often as all together. That is a lower bound of itself while
/// blocks are fewer than kLinear. For the mean's bound frames slower than it + kClip calm scales are taken as that:
/// their expectation is no larger, their tail is light. (The calm scale is no more than the pooled one, as a setting's
/// own grows with its outliers.) Once kSeenOutliers were seen, beyond the line that its own frames draw, the bound has
/// what they add less kOutlier standard errors. The upper bound takes slow frames as they are, so it contains what
/// outliers were seen, and adds kOutlier standard errors of what they contribute: pointwise, not anytime, because an
/// upper bound fails by no more than outliers add to the mean, 3 p^2 of their size if they have share p. Fast outliers
/// (drift was corrected by a control frame that was itself held up) are raised to the upper bound by the ranks of the
/// blocks' medians - kFastClip s, as their expectation is then no smaller, and counted as above once kSeenOutliers were
/// seen. A lower bound knows nothing of fast outliers that were not seen: it fails by no more than they take off.
///
/// Union bound: alpha is confidence's complement, halved for the sides, a part of each for ranks, split among settings
/// by the order in which they are first timed: in tiers, the first kTierEnds[0] of all settings share kTierAlpha[0] of
/// it, and so on. The order is known before a setting's first frame is drawn, so that each share is fixed when its
/// sequence starts, and the shares sum to one: valid for any rule of choice. Promising settings are timed first, and
/// those need narrow bounds.
class NoiseModel {
 public:
  NoiseModel(std::size_t settings, double confidence);

  struct Bounds {
    double lower = -std::numeric_limits<double>::infinity();  ///< of the expected log time
    double upper = std::numeric_limits<double>::infinity();
    double block_deviation = 0;
  };

  /// Estimates correlation, s and psi. Settings with one block have no say.
  void fit(std::span<const Observed> observed);
  /// s, of the log time of a frame.
  [[nodiscard]] double scale(const Observed& observed) const;
  /// Standard deviation of the log time of a block's median.
  [[nodiscard]] double block_deviation(const Observed& observed) const { return block_deviation(scale(observed)); }
  /// Between frames of one block: an upper estimate.
  [[nodiscard]] double correlation() const { return correlation_; }
  /// Bounds, infinite of one block; sets the estimates, too.
  Bounds bound(Observed& observed) const;

  static constexpr std::size_t kTiers = 3;
  static constexpr std::array<double, kTiers> kTierEnds{1.0 / 16, 1.0 / 4, 1};  ///< share of the settings
  static constexpr std::array<double, kTiers> kTierAlpha{0.4, 0.35, 0.25};
  static constexpr double kClip = 6;
  static constexpr double kFastClip = 4;
  static constexpr double kOutlier = 2;
  static constexpr double kSeenOutliers = 8;  ///< from which the lower bound takes them for real
  static constexpr int kLinear = 8;

 private:
  static constexpr std::size_t kRates = 12;  // of the mixture
  static constexpr int kExact = 64;          // counts up to which radii are solved one by one
  static constexpr std::size_t kTimeBins = 16;
  using Cumulants = std::array<double, kRates>;
  using Block = std::array<double, kBlock>;  // deviations from the setting's middle in its scale, by rising time
  using Beyond = std::array<std::array<double, kMostRanked>, kTiers>;
  struct Side {
    Cumulants block{};                                       // of a block's median
    Cumulants linear{};                                      // of the projection, a block
    mutable std::array<std::vector<double>, kTiers> radius;  // one a count of counts_; NaN until it is asked for
    Beyond medians{};                                        // of blocks, see rank_bound.h
    Beyond fastest{};                                        // frames of blocks
  };

  void fit_scales(std::span<const Observed> observed);
  void fit_tails(std::span<const Observed> observed);
  void fit_cumulants(std::span<const Block> blocks);
  void rank(Beyond& side, std::span<double> values) const;  // leaves them in another order
  void forget(Side& side) const;
  [[nodiscard]] double solved(const Side& side, std::size_t tier, int count) const;
  [[nodiscard]] double pooled_variance(double log_time) const;
  [[nodiscard]] double design_effect() const { return 1 + (kBlock - 1) * correlation_; }  // frames worth one
  /// Not the setting's own alone: what slows its frames must not move the line from which they count as slow.
  [[nodiscard]] double calm_scale(const Observed& observed, double own) const;
  [[nodiscard]] double block_deviation(double scale) const;
  [[nodiscard]] double degrees_of(const Observed& observed) const;
  [[nodiscard]] std::size_t tier_of(const Observed& observed) const;
  [[nodiscard]] double radius(const Side& side, const Observed& observed) const;

  std::array<std::size_t, kTiers> tier_ends_{};                  // settings
  std::array<double, kTiers> log_alpha_{};                       // log(1 / alpha) of one side's radii
  std::array<std::array<double, kMostRanked>, kTiers> tails_{};  // of the rank bounds
  std::array<double, kRates> rates_{};
  std::vector<int> counts_;
  Side above_;  // the mean above its expectation: how far the lower bound is below the mean
  Side below_;
  double correlation_ = 1;
  double first_bin_ = 0;  // log time
  double bin_width_ = 1;
  std::array<double, kTimeBins> variance_{};
};

}  // namespace reliefbench
