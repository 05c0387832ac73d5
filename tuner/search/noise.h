#pragma once
#include <array>
#include <span>
#include <vector>

#include "tuner/search/observations.h"

namespace reliefbench {

/// How far the mean of a setting's blocks may be from their expectation, at every count at once.
///
/// Let y be the log of a block's median, mu its expectation and s the setting's scale. For a cumulant bound psi with
/// E exp(l (y - mu) / s) <= exp(psi(l)), the mixture sum_j w_j exp(l_j S_k - k psi(l_j)), S_k = sum (y - mu) / s, is a
/// non-negative supermartingale of mean <= 1. By Ville's inequality it ever exceeds 1 / alpha with probability <=
/// alpha, so that |mean - mu| <= s r(k) for all k at once, where r(k) solves mixture = 1 / alpha: an anytime-valid
/// confidence sequence, however the next setting is chosen. One radius for each side, as slow outliers make the upper
/// tail heavier. With psi(l) = l^2 / 2 it is the normal mixture but for the grid. source: Howard, Ramdas, McAuliffe &
/// Sekhon, "Time-uniform, nonparametric, nonasymptotic confidence sequences", 2021, section 3 (sub-psi, mixtures).
///
/// Assumed, not proven: blocks of a setting are independent; psi and s are plugged in as estimated from pooled data.
/// s^2 is the within-setting variance of blocks, pooled over settings of similar time (fast ones are noisier), or the
/// setting's own shrunk towards that where it is larger. psi is the cumulant function of the median of kBlock draws
/// from the pooled standardised frames, from order statistics, with one frame more extreme than any seen on either
/// side; all deviations are inflated by kInflation, and psi is no less than the normal one.
///
/// Union bound: alpha is confidence's complement, halved for the sides, split among settings by the order in which they
/// are first timed: the first kEarly of all share one half, the rest the other. The order is known before a setting's
/// first frame is drawn, so that each share is fixed when its sequence starts, and the shares sum to one: valid for any
/// rule of choice. The search times promising settings first, and those are the ones that need narrow bounds.
class NoiseModel {
 public:
  NoiseModel(std::size_t settings, double confidence);

  /// Estimates s and psi. Settings with one block have no say.
  void fit(std::span<const Observed> observed);
  [[nodiscard]] double scale(const Observed& observed) const;  ///< s, of log time
  [[nodiscard]] double lower(const Observed& observed) const;  ///< bounds on the expected log time
  [[nodiscard]] double upper(const Observed& observed) const;
  [[nodiscard]] int degrees() const { return degrees_; }  ///< of freedom, behind the pooled variance

  static constexpr double kEarly = 1.0 / 16;
  static constexpr double kInflation = 1.1;

 private:
  static constexpr std::size_t kRates = 12;  // of the mixture
  static constexpr int kExact = 64;          // counts up to which radii are solved one by one
  static constexpr std::size_t kTimeBins = 16;
  struct Side {
    std::array<double, kRates> cumulant{};
    std::array<std::vector<double>, 2> radius;  // early and late settings; one a count, see count_index
  };

  void fit_scales(std::span<const Observed> observed);
  void fit_tails(std::span<const Observed> observed);
  void solve(Side& side) const;
  [[nodiscard]] double radius(const Side& side, const Observed& observed) const;

  std::size_t early_;                // settings
  std::array<double, 2> log_alpha_;  // log(1 / alpha) of one side: early, late
  std::array<double, kRates> rates_{};
  std::vector<int> counts_;
  Side above_;  // the mean above its expectation: how far the lower bound is below the mean
  Side below_;
  double first_bin_ = 0;  // log time
  double bin_width_ = 1;
  std::array<double, kTimeBins> variance_{};
  int degrees_ = 0;
};

}  // namespace reliefbench
