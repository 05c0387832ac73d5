#include "tuner/search/noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tuner/search/search.h"

namespace reliefbench {
namespace {

constexpr double kPriorNoise = 0.04;      // standard deviation of a frame's log time, before any setting was seen twice
constexpr double kPriorDegrees = 6;       // that this is worth
constexpr double kShrinkage = 20;         // degrees of freedom with which the pool outweighs a bin or a setting's own
constexpr double kLeastNoise = 1e-5;      // clocks tick
constexpr double kSmoothing = 0.7;        // standard deviation of the window over log time
constexpr double kWinsor = 5;             // standard deviations beyond which a frame counts as that for the variance
constexpr std::size_t kMostTails = 3000;  // frames that the cumulants are taken from
constexpr std::size_t kKnownTails = 300;  // frames from which the cumulants are theirs alone
constexpr double kLeastRate = 0.3;        // of the mixture, per standard deviation: best for about 500 blocks
constexpr double kMostRate = 8;           // best for one block at the smallest alpha of some thousands of settings
constexpr double kMedianVariance = 0.45;  // of the median of three standard normal values
constexpr double kLinearVariance = 0.36;  // of three times the mean statistic's share of a value
constexpr std::size_t kLeastTier = 16;    // settings
constexpr std::size_t kSeenTwice = 6;     // frames

double square(double x) { return x * x; }
double middle_of(std::span<const double> sorted) { return sorted[sorted.size() / 2]; }

double clipped_deviations(const Observed& observed, double scale) {
  const double middle = middle_of(observed.frames);
  double sum = 0;
  for (const double frame : observed.frames) sum += square(std::min(std::abs(frame - middle), kWinsor * scale));
  return sum;
}
/// The statistic of frames that are pulled into [low, high].
MedianStatistic clamped_statistic(std::span<const double> sorted, double low, double high) {
  std::vector<double> tame(sorted.begin(), sorted.end());
  for (double& frame : tame) frame = std::clamp(frame, low, high);
  return median_statistic(tame);
}
double degrees_of(const Observed& observed) { return static_cast<double>(observed.frames.size()) - 1; }

}  // namespace

NoiseModel::NoiseModel(std::size_t settings, double confidence) {
  std::size_t begin = 0;
  for (std::size_t tier = 0; tier < kTiers; ++tier) {
    const auto end = static_cast<std::size_t>(kTierEnds[tier] * static_cast<double>(settings));
    tier_ends_[tier] = std::max(end, kLeastTier * (tier + 1));
    const double alpha = (1 - confidence) / 2 * kTierAlpha[tier];
    log_alpha_[tier] = std::log(static_cast<double>(tier_ends_[tier] - begin) / alpha);
    begin = tier_ends_[tier];
  }
  for (std::size_t j = 0; j < kRates; ++j)
    rates_[j] = kLeastRate * std::pow(kMostRate / kLeastRate, static_cast<double>(j) / (kRates - 1));
  for (int k = 1; k <= kExact; ++k) counts_.push_back(k);
  while (counts_.back() < 1'000'000) counts_.push_back(counts_.back() + counts_.back() / 8);
  variance_.fill(square(kPriorNoise));
  for (Side* side : {&above_, &below_}) {
    for (std::size_t j = 0; j < kRates; ++j) {
      side->block[j] = kMedianVariance * square(rates_[j]) / 2;
      side->linear[j] = side->block[j];
    }
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
  std::vector<double> distances;
  for (const Observed& setting : observed) {
    if (!setting.is_measured()) continue;
    first = std::min(first, middle_of(setting.frames));
    last = std::max(last, middle_of(setting.frames));
    if (setting.frames.size() < kSeenTwice) continue;
    for (const double frame : setting.frames) distances.push_back(std::abs(frame - middle_of(setting.frames)));
  }
  first_bin_ = first;
  bin_width_ = std::max((last - first) / (kTimeBins - 1), 1e-9);
  variance_.fill(square(kPriorNoise));
  if (distances.empty()) return;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  variance_.fill(std::max(square(1.5 * *middle), square(kLeastNoise)));

  // Twice, as the clipping needs the scale that it is to find.
  for (int round = 0; round < 2; ++round) {
    double pooled = kPriorDegrees * square(kPriorNoise);
    double degrees = kPriorDegrees;
    std::array<double, kTimeBins> sums{};
    std::array<double, kTimeBins> weights{};
    for (const Observed& setting : observed) {
      if (setting.frames.size() < kSeenTwice) continue;
      const double at = middle_of(setting.frames);
      // A setting that was drawn hundreds of times speaks for its own noise, hardly more for its neighbours'.
      const double weight = std::min(1.0, kShrinkage / degrees_of(setting));
      const double deviations = weight * clipped_deviations(setting, std::sqrt(pooled_variance(at)));
      pooled += deviations;
      degrees += weight * degrees_of(setting);
      for (std::size_t bin = 0; bin < kTimeBins; ++bin) {
        const double distance = first_bin_ + static_cast<double>(bin) * bin_width_ - at;
        const double share = std::exp(-square(distance / kSmoothing) / 2);
        sums[bin] += share * deviations;
        weights[bin] += share * weight * degrees_of(setting);
      }
    }
    for (std::size_t bin = 0; bin < kTimeBins; ++bin) {
      const double local = (kShrinkage * pooled / degrees + sums[bin]) / (kShrinkage + weights[bin]);
      variance_[bin] = std::max(local, square(kLeastNoise));
    }
  }
}

double NoiseModel::pooled_variance(double log_time) const {
  const double position = std::clamp((log_time - first_bin_) / bin_width_, 0.0, kTimeBins - 1.0);
  const auto bin = std::min(static_cast<std::size_t>(position), kTimeBins - 2);
  const double share = position - static_cast<double>(bin);
  return (1 - share) * variance_[bin] + share * variance_[bin + 1];
}

double NoiseModel::scale(const Observed& observed) const {
  if (!observed.is_measured()) return std::sqrt(variance_.front());
  const double pooled = pooled_variance(middle_of(observed.frames));
  const double deviations = clipped_deviations(observed, std::sqrt(pooled));
  return std::sqrt((kShrinkage * pooled + deviations) / (kShrinkage + degrees_of(observed)));
}

void NoiseModel::fit_tails(std::span<const Observed> observed) {
  std::vector<double> frames;
  for (const Observed& setting : observed) {
    if (setting.frames.size() < kSeenTwice) continue;
    const double middle = middle_of(setting.frames);
    const auto n = static_cast<double>(setting.frames.size());
    // Frames lie closer to their own median than to the true one.
    const double unit = std::sqrt(n / (n - 1)) / scale(setting);
    for (const double frame : setting.frames) frames.push_back(std::clamp((frame - middle) * unit, -kFastClip, kClip));
  }
  if (frames.size() < 2 * kSeenTwice) return;
  if (frames.size() > kMostTails) {
    std::vector<double> fewer;
    for (std::size_t i = 0; i < kMostTails; ++i) fewer.push_back(frames[i * frames.size() / kMostTails]);
    frames = std::move(fewer);
  }
  frames.push_back(kClip);
  frames.push_back(std::max(1.5 * std::min(std::ranges::min(frames), 0.0), -kFastClip));
  std::ranges::sort(frames);

  // P(median of 3 is the r-th of n frames), see true_log_time.
  const auto n = static_cast<double>(frames.size());
  std::vector<double> weights;
  const auto below = [&](double rank) { return square(rank / n) * (3 - 2 * rank / n); };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto rank = static_cast<double>(i);
    weights.push_back(below(rank + 1) - below(rank));
  }
  const double mean = std::inner_product(frames.begin(), frames.end(), weights.begin(), 0.0);
  const std::vector<double> projection = median_projection(frames);
  const double centre = std::accumulate(projection.begin(), projection.end(), 0.0) / n;
  for (std::size_t j = 0; j < kRates; ++j) {
    const double rate = rates_[j];
    std::array<double, 4> sums{};
    for (std::size_t i = 0; i < frames.size(); ++i) {
      // exp of some hundreds: only where all others are identical; the radius is then huge in any case
      const double block = std::clamp(rate * (frames[i] - mean), -300.0, 300.0);
      const double linear = std::clamp(rate * (projection[i] - centre), -300.0, 300.0);
      sums[0] += weights[i] * std::exp(block);
      sums[1] += weights[i] * std::exp(-block);
      sums[2] += std::exp(linear) / n;
      sums[3] += std::exp(-linear) / n;
    }
    // Few frames say little of the tails: psi is then no less than the normal one.
    const double normal = frames.size() < kKnownTails ? square(rate) / 2 : 0;
    above_.block[j] = std::max(kMedianVariance * normal, std::log(sums[0]));
    below_.block[j] = std::max(kMedianVariance * normal, std::log(sums[1]));
    above_.linear[j] = std::max(kLinearVariance * normal, kBlock * std::log(sums[2]));
    below_.linear[j] = std::max(kLinearVariance * normal, kBlock * std::log(sums[3]));
  }
}

void NoiseModel::solve(Side& side) const {
  std::array<double, kRates> exponent{};
  for (std::size_t tier = 0; tier < kTiers; ++tier) {
    std::vector<double>& radius = side.radius[tier];
    radius.clear();
    const double target = log_alpha_[tier] + std::log(static_cast<double>(kRates));
    for (const int count : counts_) {
      const Cumulants& cumulant = count < kLinear ? side.block : side.linear;
      // Newton on log sum exp(count (rate r - cumulant)) = target, convex and rising in r; started where one term alone
      // reaches the target, so from above.
      double r = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < kRates; ++j) r = std::min(r, (cumulant[j] + target / count) / rates_[j]);
      for (int step = 0; step < 20; ++step) {
        double most = -std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < kRates; ++j) {
          exponent[j] = count * (rates_[j] * r - cumulant[j]);
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
  std::size_t tier = 0;
  while (tier + 1 < kTiers && static_cast<std::size_t>(observed.order) >= tier_ends_[tier]) ++tier;
  const std::vector<double>& radii = side.radius[tier];
  const int count = observed.blocks();
  // Between counts that were solved the radius falls with the root of the count, but for a share of a percent.
  const auto above = std::ranges::upper_bound(counts_, count);
  const auto index = static_cast<std::size_t>(above - counts_.begin()) - 1;
  return radii[index] * std::sqrt(static_cast<double>(counts_[index]) / count);
}

NoiseModel::Bounds NoiseModel::bound(Observed& observed) const {
  const double own = scale(observed);
  const std::vector<double>& frames = observed.frames;
  const MedianStatistic plain = median_statistic(frames);
  observed.mean = plain.mean;
  observed.clipped = plain.mean;
  // Of few frames most may be outliers, and with them the quartile: seed 111 of the recorded sweep drew five of six.
  const double most = frames.size() < kFewFrames
                          ? std::min(frames.front() + kFewClip * own, frames[frames.size() / 4] + kClip * own)
                          : frames[frames.size() / 4] + kClip * own;
  double error = 0;     // of what outliers add
  double at_least = 0;  // of it
  if (frames.back() > most) {
    const MedianStatistic clipped = clamped_statistic(frames, frames.front(), most);
    observed.clipped = clipped.mean;
    const double added = std::max(0.0, plain.variance - clipped.variance);
    error = kOutlier * std::sqrt(added / static_cast<double>(frames.size()));
    if (frames.end() - std::ranges::upper_bound(frames, most) >= kSeenOutliers)
      at_least = std::max(0.0, plain.mean - clipped.mean - error);
  }
  const double least = frames[3 * frames.size() / 4] - kFastClip * own;
  const double raised = frames.front() < least ? clamped_statistic(frames, least, frames.back()).mean : plain.mean;
  return {.lower = observed.clipped + at_least - own * radius(above_, observed),
          .upper = raised + own * radius(below_, observed) + error};
}

}  // namespace reliefbench
