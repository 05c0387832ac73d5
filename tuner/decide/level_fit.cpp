#include "tuner/decide/level_fit.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kMadToSigma = 1.4826;           // of a normal distribution
constexpr double kMeanAbsoluteToSigma = 1.2533;  // of a normal distribution
constexpr double kSpike = 4;                     // sigma, of many values
constexpr double kSpikeOfFew = 16;               // over their number, beyond that: sigma is less certain
constexpr double kLenientPenalty = 10;           // in sigma^2, of a step that is proposed
constexpr double kMostRho = 0.95;
constexpr double kRhoPrior = 20;         // values without autocorrelation that are taken as seen before
constexpr double kCommonDf = 16;         // degrees of freedom that the noise of all levels is worth to one
constexpr double kPlaceQuantile = 7.35;  // -2 log(1 - sqrt(.95))

std::vector<double> absolute(std::span<const double> values) {
  std::vector<double> result(values.begin(), values.end());
  for (double& value : result) value = std::abs(value);
  return result;
}

/// Standard deviation of values that are centred on 0.
double robust_sigma(std::span<const double> values) {
  if (values.empty()) return 0;
  const std::vector<double> sizes = absolute(values);
  const double mad = kMadToSigma * median(sizes);
  if (mad > 0) return mad;
  return kMeanAbsoluteToSigma * std::accumulate(sizes.begin(), sizes.end(), 0.0) / static_cast<double>(sizes.size());
}

/// What is left of values beside the median of the 2 * least - 1 round them; at the ends, of the first and last so
/// many.
std::vector<double> from_local_median(std::span<const double> values, std::size_t least) {
  const std::size_t width = std::min(2 * least - 1, values.size());
  std::vector<double> rest;
  rest.reserve(values.size());
  std::vector<double> window;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t first = std::min(i - std::min(i, least - 1), values.size() - width);
    window.assign(values.begin() + static_cast<std::ptrdiff_t>(first),
                  values.begin() + static_cast<std::ptrdiff_t>(first + width));
    const auto middle = window.begin() + static_cast<std::ptrdiff_t>(width / 2);
    std::nth_element(window.begin(), middle, window.end());
    rest.push_back(values[i] - *middle);
  }
  return rest;
}

}  // namespace

double difference_sigma(std::span<const double> values) {
  std::vector<double> differences;
  for (std::size_t i = 1; i < values.size(); ++i) differences.push_back(values[i] - values[i - 1]);
  return robust_sigma(differences) / std::numbers::sqrt2;
}

std::vector<std::size_t> lone_values(std::span<const double> values, std::size_t least, double least_sigma) {
  if (values.size() < 2 * least - 1) return {};
  const std::vector<double> rest = from_local_median(values, least);
  const double sigma = std::max({difference_sigma(values), robust_sigma(rest), least_sigma});
  const double limit = (kSpike + kSpikeOfFew / static_cast<double>(values.size())) * sigma;
  std::vector<std::size_t> lone;
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (std::abs(rest[i]) > limit) lone.push_back(i);
  return lone;
}

std::vector<std::size_t> all_but(std::span<const std::size_t> lone, std::size_t n) {
  std::vector<std::size_t> others;
  others.reserve(n - lone.size());
  auto next = lone.begin();
  for (std::size_t i = 0; i < n; ++i) {
    if (next != lone.end() && *next == i)
      ++next;
    else
      others.push_back(i);
  }
  return others;
}

double mean_inflation(std::size_t m, double rho) {
  const auto n = static_cast<double>(m);
  return (1 + rho) / (1 - rho) - 2 * rho * (1 - std::pow(rho, n)) / (n * (1 - rho) * (1 - rho));
}

LevelFit::LevelFit(std::span<const double> values, std::size_t least, double least_sigma)
    : least_(least), least_sigma_(least_sigma), values_(values.begin(), values.end()) {
  assert(least_sigma > 0 && std::ranges::all_of(values, [](double value) { return std::isfinite(value); }));
  if (!values_.empty()) centre_ = median(values_);
  sums_.push_back(0);
  for (double& value : values_) {
    value -= centre_;
    sums_.push_back(sums_.back() + value);
  }
  propose();
  if (starts_.size() == 1) split_once();
  estimate_noise();
}

/// The partition with the least sum of squares + penalty * steps, of levels that are long enough. The sum of squares
/// is that of all values less sum^2 / length of each level.
void LevelFit::propose() {
  const std::size_t n = values_.size();
  const double sigma = std::max(difference_sigma(values_), least_sigma_);
  const double penalty = kLenientPenalty * sigma * sigma;
  std::vector<double> best(n + 1, -std::numeric_limits<double>::infinity());
  std::vector<double> reciprocals(n + 1, 1);
  for (std::size_t i = 2; i <= n; ++i) reciprocals[i] = 1 / static_cast<double>(i);
  std::vector<std::size_t> last_start(n + 1, 0);
  best[0] = penalty;
  for (std::size_t end = least_; end <= n; ++end) {
    for (std::size_t start = 0; start + least_ <= end; ++start) {
      const double part = sums_[end] - sums_[start];
      const double total = best[start] + part * part * reciprocals[end - start];
      if (total > best[end]) {
        best[end] = total;
        last_start[end] = start;
      }
    }
    best[end] -= penalty;
  }
  for (std::size_t end = n; end > 0; end = last_start[end]) starts_.push_back(last_start[end]);
  if (starts_.empty()) starts_.push_back(0);
  std::ranges::reverse(starts_);
}

/// Whether or not it is worth a penalty: how strong it is, is judged by the noise about both levels.
void LevelFit::split_once() {
  if (values_.size() >= 2 * least_) starts_.push_back(best_split(0, values_.size()));
}

double LevelFit::split_score(std::size_t first, std::size_t at, std::size_t end) const {
  const double left = sum(first, at);
  const double right = sum(at, end);
  return left * left / static_cast<double>(at - first) + right * right / static_cast<double>(end - at);
}

std::size_t LevelFit::best_split(std::size_t first, std::size_t end) const {
  std::size_t best = first + least_;
  for (std::size_t at = best + 1; at + least_ <= end; ++at)
    if (split_score(first, at, end) > split_score(first, best, end)) best = at;
  return best;
}

/// Moments of what is left about the levels, which took degrees of freedom: the more of them, the more alike the values
/// of a level are. The bias of the autocorrelation is that of Kendall, "Note on bias in the estimation of
/// autocorrelation", 1954, once for every level.
void LevelFit::estimate_noise() {
  const auto n = static_cast<double>(values_.size());
  std::vector<double> squares;
  double all_squares = 0;
  double products = 0;
  double before = 0;
  for (std::size_t level = 0; level < starts_.size(); ++level) {
    const double centre = mean(level) - centre_;
    squares.push_back(0);
    for (std::size_t i = starts_[level]; i < end(level); ++i) {
      const double rest = values_[i] - centre;
      squares.back() += rest * rest;
      products += rest * before;
      before = rest;
    }
    all_squares += squares.back();
  }
  rho_ = 0;
  if (n > 3 && all_squares > 0) {
    const double unbiased = (n * products / all_squares + static_cast<double>(starts_.size())) / (n - 3);
    rho_ = std::clamp(unbiased * n / (n + kRhoPrior), 0.0, kMostRho);
  }
  std::vector<double> df;
  for (std::size_t level = 0; level < starts_.size(); ++level) {
    const std::size_t length = std::max<std::size_t>(end(level) - starts_[level], 1);
    df.push_back(static_cast<double>(length) - mean_inflation(length, rho_));
  }
  df_ = std::max(std::accumulate(df.begin(), df.end(), 0.0), 1.0);
  variance_ = std::max(all_squares / df_, least_sigma_ * least_sigma_);
  level_variances_.clear();
  for (std::size_t level = 0; level < starts_.size(); ++level)
    level_variances_.push_back(std::max(variance_, (kCommonDf * variance_ + squares[level]) / (kCommonDf + df[level])));
}

std::size_t LevelFit::weakest() const {
  std::size_t weakest = 1;
  for (std::size_t level = 2; level < starts_.size(); ++level)
    if (gain(level) < gain(weakest)) weakest = level;
  return weakest;
}

/// The steps beside it may be elsewhere without it.
void LevelFit::remove_weakest() {
  const std::size_t gone = weakest();
  starts_.erase(starts_.begin() + static_cast<std::ptrdiff_t>(gone));
  for (std::size_t level = std::max<std::size_t>(gone, 2) - 1; level <= gone && level < starts_.size(); ++level)
    starts_[level] = best_split(starts_[level - 1], end(level));
  estimate_noise();
}

void LevelFit::keep_gains_of(double least_gain) {
  while (starts_.size() > 1 && gain(weakest()) < least_gain) remove_weakest();
}

double LevelFit::strongest_gain() {
  double strongest = 0;
  for (; starts_.size() > 1; remove_weakest()) strongest = std::max(strongest, gain(weakest()));
  return strongest;
}

std::size_t LevelFit::end(std::size_t level) const {
  return level + 1 < starts_.size() ? starts_[level + 1] : values_.size();
}

double LevelFit::mean(std::size_t level) const {
  const std::size_t first = starts_[level];
  return centre_ + sum(first, end(level)) / static_cast<double>(std::max<std::size_t>(end(level) - first, 1));
}

double LevelFit::mean_variance(std::size_t level) const {
  const std::size_t length = std::max<std::size_t>(end(level) - starts_[level], 1);
  return level_variances_[level] * mean_inflation(length, rho_) / static_cast<double>(length);
}

double LevelFit::gain(std::size_t level) const {
  const double step = mean(level) - mean(level - 1);
  return step * step / (mean_variance(level) + mean_variance(level - 1));
}

LevelFit::Range LevelFit::start_range(std::size_t level) const {
  const std::size_t first = starts_[level - 1];
  const std::size_t last = end(level);
  const double enough = split_score(first, starts_[level], last) - kPlaceQuantile * variance_ * (1 + rho_) / (1 - rho_);
  Range range{.first = starts_[level], .last = starts_[level]};
  for (std::size_t at = first + 1; at < last; ++at) {
    if (split_score(first, at, last) < enough) continue;
    range.first = std::min(range.first, at);
    range.last = std::max(range.last, at);
  }
  return range;
}

double LevelFit::sigma() const { return std::sqrt(variance_); }

int LevelFit::df() const { return std::max(1, static_cast<int>(df_)); }

}  // namespace reliefbench
