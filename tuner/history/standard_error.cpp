#include "tuner/history/standard_error.h"

#include <cmath>
#include <numbers>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kSigmaPerMad = 1.4826;  // of a normal distribution

double relative_variance(const RobustMedian& m) {
  const double sigma = kSigmaPerMad * m.mad / m.median;
  return sigma * sigma;
}

double error_of(double variance, int n) { return n < 2 ? 0 : std::sqrt(std::numbers::pi / 2 * variance / n); }

}  // namespace

double log_median_error(double median, double mad, int n) {
  return error_of(relative_variance({.median = median, .mad = mad, .n = n}), n);
}

std::vector<double> moderated_errors(std::span<const RobustMedian> medians) {
  std::vector<double> variances;
  std::vector<int> df;
  for (const RobustMedian& m : medians) {
    const bool has_scatter = m.n > 1 && m.median > 0;
    variances.push_back(has_scatter ? relative_variance(m) : 0);
    df.push_back(has_scatter ? m.n - 1 : 0);
  }
  const VariancePrior prior = variance_prior(variances, df);
  std::vector<double> errors;
  for (std::size_t i = 0; i < medians.size(); ++i)
    errors.push_back(df[i] == 0 ? 0 : error_of(prior.moderated(variances[i], df[i]), medians[i].n));
  return errors;
}

}  // namespace reliefbench
