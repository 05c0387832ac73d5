#pragma once
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// Median with a distribution-free confidence interval of order statistics: the narrowest that covers at least 95 %, or
/// the whole range where n is too small for that. interval_coverage() says what it covers.
struct Summary {
  double median = 0;
  double mad = 0;  ///< median absolute deviation, unscaled
  double ci_low = 0;
  double ci_high = 0;
  int n = 0;
};
[[nodiscard]] double median(std::span<const double> values);  ///< values not empty
[[nodiscard]] Summary summarise(std::span<const double> values);

/// The confidence that the interval of summarise() has, from any distribution: 1 - 2 P(Binomial(n, 1/2) <= k), where k
/// values are left out on either side. .978 for ten values, .9375 for five, 0 for one.
[[nodiscard]] double interval_coverage(int n);
/// What every printed interval is labelled with: "97.9 %"; "1 sample" where there is no interval.
[[nodiscard]] std::string coverage_text(int n);

/// Holm's step-down correction: adjusted p-values, same order.
[[nodiscard]] std::vector<double> holm(std::span<const double> p_values);

[[nodiscard]] double geometric_mean(std::span<const double> values);

/// From here on Student's t is taken to be this one: wider than the normal by half a percent.
inline constexpr int kMostDf = 200;
/// Degrees of freedom of a sum of two estimated variances. source: Satterthwaite, "An approximate distribution of
/// estimates of variance components", 1946
[[nodiscard]] double df_of_sum(double a, double df_a, double b, double df_b);
/// Two-sided p of Student's t: P(|T| >= |t|). df: at least 1
[[nodiscard]] double student_t_p(double t, int df);
/// The t that |T| exceeds with probability p.
[[nodiscard]] double student_t_quantile(double p, int df);

/// Huber's estimate of location: values beyond 1.5 robust standard deviations of the median count as if they were
/// there. One step from the median with the MAD as scale.
/// source: Huber & Ronchetti, "Robust Statistics", 2nd edition, 2009, chapters 3 and 6
struct Location {
  double value = 0;
  /// Of each value: what it contributes to n times the estimate's error. Their sum is 0; the variance of the estimate
  /// is sum(influence^2) / (n (n - 1)).
  std::vector<double> influence;
};
[[nodiscard]] Location huber_location(std::span<const double> values);  ///< values not empty

/// How variances of one kind of measurement scatter: those of small samples borrow strength from each other.
/// source: Smyth, "Linear models and empirical Bayes methods", 2004, section 6
struct VariancePrior {
  double variance = 0;
  double df = 0;  ///< degrees of freedom that the prior is worth; infinite where all variances may be one
  /// The prior's and an own variance, weighted by their degrees of freedom.
  [[nodiscard]] double moderated(double own_variance, double own_df) const;
};
/// variances: each of a sample with so many degrees of freedom; those with none have no say
[[nodiscard]] VariancePrior variance_prior(std::span<const double> variances, std::span<const int> df);

}  // namespace reliefbench
