#include "tuner/search/noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tuner/search/search.h"

namespace reliefbench {
namespace {

constexpr double kPriorNoise = 0.03;      // standard deviation of a block's log time, before any was seen twice
constexpr double kPriorDegrees = 4;       // that this is worth
constexpr double kShrinkage = 10;         // degrees of freedom with which the pool outweighs a bin or a setting's own
constexpr double kLeastNoise = 1e-5;      // clocks tick
constexpr double kSmoothing = 0.7;        // standard deviation of the window over log time
constexpr std::size_t kMostTails = 3000;  // frames that the cumulants are taken from
constexpr double kLeastRate = 0.25;       // of the mixture, per standard deviation: best for about 300 blocks
constexpr double kMostRate = 5.5;         // best for one block at the smallest alpha of some thousands of settings

double square(double x) { return x * x; }

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

NoiseModel::NoiseModel(std::size_t settings, double confidence)
    : early_(std::max<std::size_t>(16, static_cast<std::size_t>(static_cast<double>(settings) * kEarly))) {
  const double half = (1 - confidence) / 2 / 2;  // a side's, a group's
  const auto late = static_cast<double>(settings > early_ ? settings - early_ : 1);
  log_alpha_ = {std::log(static_cast<double>(early_) / half), std::log(late / half)};
  for (std::size_t j = 0; j < kRates; ++j)
    rates_[j] = kLeastRate * std::pow(kMostRate / kLeastRate, static_cast<double>(j) / (kRates - 1));
  for (int k = 1; k <= kExact; ++k) counts_.push_back(k);
  while (counts_.back() < 1'000'000) counts_.push_back(counts_.back() + counts_.back() / 8);
  variance_.fill(square(kPriorNoise));
  for (Side* side : {&above_, &below_}) {
    for (std::size_t j = 0; j < kRates; ++j) side->cumulant[j] = square(kInflation * rates_[j]) / 2;
    solve(*side);
  }
}

void NoiseModel::fit(std::span<const Observed> observed) {
  fit_scales(observed);
  fit_tails(observed);
  solve(above_);
  solve(below_);
}

void NoiseModel::fit_scales(std::span<const Observed> observed) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  degrees_ = 0;
  double sum = kPriorDegrees * square(kPriorNoise);
  for (const Observed& setting : observed) {
    if (!setting.is_measured()) continue;
    first = std::min(first, setting.mean);
    last = std::max(last, setting.mean);
    sum += setting.deviations();
    degrees_ += setting.count() - 1;
  }
  // The prior fades: it is there for the first few blocks only.
  const double pooled =
      degrees_ > 100 ? (sum - kPriorDegrees * square(kPriorNoise)) / degrees_ : sum / (kPriorDegrees + degrees_);
  first_bin_ = first;
  bin_width_ = std::max((last - first) / (kTimeBins - 1), 1e-9);
  std::array<double, kTimeBins> sums{};
  std::array<double, kTimeBins> weights{};
  for (const Observed& setting : observed) {
    if (setting.count() < 2) continue;
    // A setting that was drawn hundreds of times speaks for its own noise, hardly more for its neighbours'.
    const double degrees = setting.count() - 1;
    const double weight = std::min(1.0, kShrinkage / degrees);
    const double deviations = setting.deviations();
    for (std::size_t bin = 0; bin < kTimeBins; ++bin) {
      const double distance = first_bin_ + static_cast<double>(bin) * bin_width_ - setting.mean;
      const double share = weight * std::exp(-square(distance / kSmoothing) / 2);
      sums[bin] += share * deviations;
      weights[bin] += share * degrees;
    }
  }
  for (std::size_t bin = 0; bin < kTimeBins; ++bin) {
    const double local = (kShrinkage * pooled + sums[bin]) / (kShrinkage + weights[bin]);
    variance_[bin] = std::max(local, square(kLeastNoise));
  }
}

double NoiseModel::scale(const Observed& observed) const {
  const double position = std::clamp((observed.mean - first_bin_) / bin_width_, 0.0, kTimeBins - 1.0);
  const auto bin = std::min(static_cast<std::size_t>(position), kTimeBins - 2);
  const double share = position - static_cast<double>(bin);
  const double pooled = (1 - share) * variance_[bin] + share * variance_[bin + 1];
  const double degrees = std::max(0, observed.count() - 1);
  const double own = (kShrinkage * pooled + observed.deviations()) / (kShrinkage + degrees);
  return std::sqrt(std::max(pooled, own));
}

void NoiseModel::fit_tails(std::span<const Observed> observed) {
  std::vector<double> frames;
  for (const Observed& setting : observed) {
    if (setting.count() < 2) continue;
    const double middle = median_of(setting.frames);
    const double n = static_cast<double>(setting.frames.size());
    // Frames lie closer to their own median than to the true one.
    const double unit = std::sqrt(n / (n - 1)) / scale(setting);
    for (const double frame : setting.frames) frames.push_back((frame - middle) * unit);
  }
  if (frames.size() < 2 * kBlock) return;
  if (frames.size() > kMostTails) {
    std::vector<double> fewer;
    for (std::size_t i = 0; i < kMostTails; ++i) fewer.push_back(frames[i * frames.size() / kMostTails]);
    frames = std::move(fewer);
  }
  std::ranges::sort(frames);
  frames.insert(frames.begin(), 1.5 * std::min(frames.front(), 0.0));
  frames.push_back(1.5 * std::max(frames.back(), 0.0));

  // P(median of 3 is the r-th of n frames), see true_log_time.
  std::vector<double> weights;
  const auto n = static_cast<double>(frames.size());
  const auto below = [&](double rank) { return square(rank / n) * (3 - 2 * rank / n); };
  for (double rank = 0; rank < n; ++rank) weights.push_back(below(rank + 1) - below(rank));
  const double mean = std::inner_product(frames.begin(), frames.end(), weights.begin(), 0.0);
  double variance = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) variance += weights[i] * square(frames[i] - mean);
  // Frames of a block may be alike: then blocks vary more than medians of independent frames would.
  const double unit = kInflation / std::sqrt(std::min(1.0, std::max(variance, 1e-6)));
  for (std::size_t j = 0; j < kRates; ++j) {
    double up = 0;
    double down = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const double deviation = rates_[j] * unit * (frames[i] - mean);
      // exp of more than some hundreds: only where all others are identical; the radius is then huge in any case
      up += weights[i] * std::exp(std::min(deviation, 500.0));
      down += weights[i] * std::exp(std::min(-deviation, 500.0));
    }
    const double normal = square(kInflation * rates_[j]) / 2;
    above_.cumulant[j] = std::max(normal, std::log(up));
    below_.cumulant[j] = std::max(normal, std::log(down));
  }
}

void NoiseModel::solve(Side& side) const {
  std::array<double, kRates> exponent{};
  for (std::size_t group = 0; group < 2; ++group) {
    std::vector<double>& radius = side.radius[group];
    radius.clear();
    const double target = log_alpha_[group] + std::log(static_cast<double>(kRates));
    for (const int count : counts_) {
      // Newton on log sum exp(count (rate r - cumulant)) = target, convex and rising in r; started where one term alone
      // reaches the target, so from above.
      double r = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < kRates; ++j) r = std::min(r, (side.cumulant[j] + target / count) / rates_[j]);
      for (int step = 0; step < 20; ++step) {
        double most = -std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < kRates; ++j) {
          exponent[j] = count * (rates_[j] * r - side.cumulant[j]);
          most = std::max(most, exponent[j]);
        }
        double sum = 0;
        double slope = 0;
        for (std::size_t j = 0; j < kRates; ++j) {
          const double term = std::exp(exponent[j] - most);
          sum += term;
          slope += term * rates_[j] * count;
        }
        const double change = (most + std::log(sum) - target) * sum / slope;
        r -= change;
        if (std::abs(change) < 1e-9 * r) break;
      }
      radius.push_back(r);
    }
  }
}

double NoiseModel::radius(const Side& side, const Observed& observed) const {
  const std::vector<double>& radii = side.radius[static_cast<std::size_t>(observed.order) < early_ ? 0 : 1];
  const int count = observed.count();
  // Between counts that were solved, that of the lower one: wider, so safe.
  const auto above = std::ranges::upper_bound(counts_, count);
  const auto index = static_cast<std::size_t>(above - counts_.begin()) - 1;
  return radii[index] * std::sqrt(static_cast<double>(counts_[index]) / count);
}

double NoiseModel::lower(const Observed& observed) const {
  return observed.mean - scale(observed) * radius(above_, observed);
}
double NoiseModel::upper(const Observed& observed) const {
  return observed.mean + scale(observed) * radius(below_, observed);
}

}  // namespace reliefbench
