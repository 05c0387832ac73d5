#pragma once
#include <array>
#include <span>
#include <vector>

#include "tuner/search/observations.h"

namespace reliefbench {

/// How far the estimate of a setting's log time may be from its expectation, at every count of blocks at once.
///
/// Let y be the log of a block's median, mu its expectation, s the scale of the setting's frames and psi a bound with
/// E exp(l (y - mu) / s) <= exp(psi(l)). The mixture sum_j w_j exp(l_j S_k - k psi(l_j)), S_k = sum (y - mu) / s, is a
/// non-negative supermartingale of mean <= 1. By Ville's inequality it ever exceeds 1 / alpha with probability <=
/// alpha, so that |mean - mu| <= s r(k) for all k at once, where r(k) solves mixture = 1 / alpha: an anytime-valid
/// confidence sequence, however the next setting is chosen. With psi(l) = l^2 / 2 it is the normal mixture but for the
/// grid. source: Howard, Ramdas, McAuliffe & Sekhon, "Time-uniform, nonparametric, nonasymptotic confidence sequences",
/// 2021. The estimate is not the mean of disjoint blocks but MedianStatistic, whose cumulants are no larger (Hoeffding
/// 1963); from kLinear blocks on psi is that of its first-order projection.
///
/// What is plugged in and so assumed, not proven: frames of a setting are independent. s^2 is the variance of clipped
/// frames within a setting, pooled over settings of similar time (fast ones are noisier), and the setting's own shrunk
/// towards that. psi is the cumulant function of pooled standardised frames, one more extreme than
/// any seen added at either end; while these are few, psi is no less than the normal one.
///
/// Slow outliers (another process takes a core for a time slice: the frame takes several times as long) have no useful
/// psi. The lower bound therefore takes frames slower than the lower quartile + kClip s as that, and of fewer than
/// kFewFrames those slower than the fastest + kFewClip s: their expectation is no larger, and their tail is light
/// unless outliers are so frequent that these anchors are outliers themselves, which is assumed not to be; once
/// kSeenOutliers were seen it has what they add less kOutlier standard errors. The upper bound takes frames as they
/// are, so it contains what outliers were seen, and adds kOutlier standard errors of what they contribute: pointwise,
/// not anytime, because an upper bound fails by no more than outliers add to the mean, 3 p^2 of their size if they have
/// share p. Fast outliers (drift was corrected by a control frame that was itself held up) are raised to the upper
/// quartile - kFastClip s for the upper bound, as their expectation is then no smaller.
///
/// Union bound: alpha is confidence's complement, halved for the sides, split among settings by the order in which they
/// are first timed: in tiers, the first kTierEnds[0] of all settings share kTierAlpha[0] of it, and so on. The order is
/// known before a setting's first frame is drawn, so that each share is fixed when its sequence starts, and the shares
/// sum to one: valid for any rule of choice. Promising settings are timed first, and those need narrow bounds.
class NoiseModel {
 public:
  NoiseModel(std::size_t settings, double confidence);

  struct Bounds {
    double lower = 0;  // of the expected log time
    double upper = 0;
  };

  /// Estimates s and psi. Settings with one block have no say.
  void fit(std::span<const Observed> observed);
  /// s, of the log time of a frame.
  [[nodiscard]] double scale(const Observed& observed) const;
  /// Bounds; sets the estimates, too.
  Bounds bound(Observed& observed) const;

  static constexpr std::size_t kTiers = 3;
  static constexpr std::array<double, kTiers> kTierEnds{1.0 / 16, 1.0 / 4, 1};  ///< share of the settings
  static constexpr std::array<double, kTiers> kTierAlpha{0.4, 0.35, 0.25};
  static constexpr double kClip = 6;
  static constexpr double kFewClip = 4;
  static constexpr double kFastClip = 4;
  static constexpr std::size_t kFewFrames = 12;
  static constexpr double kOutlier = 2;
  static constexpr std::ptrdiff_t kSeenOutliers = 8;  ///< from which the lower bound takes them for real
  static constexpr int kLinear = 8;

 private:
  static constexpr std::size_t kRates = 12;  // of the mixture
  static constexpr int kExact = 64;          // counts up to which radii are solved one by one
  static constexpr std::size_t kTimeBins = 16;
  using Cumulants = std::array<double, kRates>;
  struct Side {
    Cumulants block{};                               // of a block's median
    Cumulants linear{};                              // of the projection, a block
    std::array<std::vector<double>, kTiers> radius;  // one a count of counts_
  };

  void fit_scales(std::span<const Observed> observed);
  void fit_tails(std::span<const Observed> observed);
  void solve(Side& side) const;
  [[nodiscard]] double pooled_variance(double log_time) const;
  [[nodiscard]] double radius(const Side& side, const Observed& observed) const;

  std::array<std::size_t, kTiers> tier_ends_{};  // settings
  std::array<double, kTiers> log_alpha_{};       // log(1 / alpha) of one side
  std::array<double, kRates> rates_{};
  std::vector<int> counts_;
  Side above_;  // the mean above its expectation: how far the lower bound is below the mean
  Side below_;
  double first_bin_ = 0;  // log time
  double bin_width_ = 1;
  std::array<double, kTimeBins> variance_{};
};

}  // namespace reliefbench
