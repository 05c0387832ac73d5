#include "tuner/search/noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tuner/search/correlation.h"
#include "tuner/search/loops.h"
#include "tuner/search/rank_bound.h"

namespace reliefbench {
namespace {

constexpr double kPriorNoise = 0.04;      // standard deviation of a frame's log time, before any setting was seen twice
constexpr double kPriorDegrees = 6;       // that this is worth
constexpr double kShrinkage = 20;         // degrees of freedom with which the pool outweighs a bin or a setting's own
constexpr double kLeastNoise = 1e-5;      // clocks tick
constexpr double kSmoothing = 0.7;        // standard deviation of the window over log time
constexpr double kWinsor = 5;             // standard deviations beyond which a frame counts as that for the variance
constexpr std::size_t kMostTails = 1000;  // blocks that the cumulants are taken from
constexpr std::size_t kKnownTails = 100;  // blocks from which the cumulants are theirs alone
constexpr double kLeastRate = 0.3;        // of the mixture, per standard deviation: best for about 500 blocks
constexpr double kMostRate = 8;           // best for one block at the smallest alpha of some thousands of settings
constexpr double kMedianVariance = 0.45;  // of the median of three standard normal values
constexpr double kLinearVariance = 0.36;  // of three times the mean statistic's share of a value
constexpr std::size_t kLeastTier = 16;    // settings
constexpr int kSeenTwice = 2;             // blocks
constexpr int kSeenThrice = 3;            // blocks from which it shows which one is odd
constexpr double kRankAlpha = 0.4;        // of a side's alpha is for the rank bounds, in halves

constexpr double kNoBound = std::numeric_limits<double>::infinity();

double square(double x) { return x * x; }
double middle_of(std::span<const double> sorted) { return sorted[sorted.size() / 2]; }

double clipped_deviations(const Observed& observed, double scale) {
  const double middle = middle_of(observed.frames);
  const double most = kWinsor * scale;
  return sum_of(static_cast<int>(observed.frames.size()), [&](int i) {
    return square(std::min(std::abs(observed.frames[static_cast<std::size_t>(i)] - middle), most));
  });
}

}  // namespace

NoiseModel::NoiseModel(std::size_t settings, double confidence) {
  std::size_t begin = 0;
  for (std::size_t tier = 0; tier < kTiers; ++tier) {
    const auto end = static_cast<std::size_t>(kTierEnds[tier] * static_cast<double>(settings));
    tier_ends_[tier] = std::max(end, kLeastTier * (tier + 1));
    const double alpha = (1 - confidence) / 2 * kTierAlpha[tier];
    const double log_alpha = std::log(static_cast<double>(tier_ends_[tier] - begin) / alpha);
    log_alpha_[tier] = log_alpha - std::log1p(-kRankAlpha);
    tails_[tier] = tails_for(log_alpha - std::log(kRankAlpha / 2));
    begin = tier_ends_[tier];
  }
  for (std::size_t j = 0; j < kRates; ++j)
    rates_[j] = kLeastRate * std::pow(kMostRate / kLeastRate, static_cast<double>(j) / (kRates - 1));
  for (int k = 1; k <= kExact; ++k) counts_.push_back(k);
  while (counts_.back() < 1'000'000) counts_.push_back(counts_.back() + counts_.back() / 8);
  variance_.fill(square(kPriorNoise));
  for (Side* side : {&above_, &below_}) {
    for (std::size_t j = 0; j < kRates; ++j) side->linear[j] = side->block[j] = square(rates_[j]) / 2;
    forget(*side);
    rank(side->medians, {});
    rank(side->fastest, {});
  }
}

void NoiseModel::fit(std::span<const Observed> observed) {
  fit_scales(observed);
  fit_tails(observed);
  for (Side* side : {&above_, &below_}) forget(*side);
}

void NoiseModel::fit_scales(std::span<const Observed> observed) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  std::vector<double> distances;
  for (const Observed& setting : observed) {
    if (!setting.is_measured()) continue;
    first = std::min(first, middle_of(setting.frames));
    last = std::max(last, middle_of(setting.frames));
    if (setting.count() < kSeenTwice) continue;
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
      if (setting.count() < kSeenTwice) continue;
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
  BlockCorrelation correlation;
  for (const Observed& setting : observed)
    if (setting.is_measured()) correlation.add(setting, std::sqrt(pooled_variance(middle_of(setting.frames))));
  correlation_ = correlation.upper_estimate();
}

double NoiseModel::pooled_variance(double log_time) const {
  const double position = std::clamp((log_time - first_bin_) / bin_width_, 0.0, kTimeBins - 1.0);
  const auto bin = std::min(static_cast<std::size_t>(position), kTimeBins - 2);
  const double share = position - static_cast<double>(bin);
  return (1 - share) * variance_[bin] + share * variance_[bin + 1];
}

double NoiseModel::degrees_of(const Observed& observed) const {
  return std::max(0.0, static_cast<double>(observed.frames.size()) - design_effect());
}

double NoiseModel::scale(const Observed& observed) const {
  if (!observed.is_measured()) return std::sqrt(variance_.front());
  const double pooled = pooled_variance(middle_of(observed.frames));
  if (observed.count() < kSeenTwice) return std::sqrt(pooled);
  const double deviations = clipped_deviations(observed, std::sqrt(pooled));
  return std::sqrt((kShrinkage * pooled + deviations) / (kShrinkage + degrees_of(observed)));
}

double NoiseModel::calm_scale(const Observed& observed, double own) const {
  return std::min(own, std::sqrt(pooled_variance(middle_of(observed.frames))));
}

double NoiseModel::block_deviation(double scale) const {
  return std::sqrt(kMedianVariance + (1 - kMedianVariance) * correlation_) * scale;
}

void NoiseModel::fit_tails(std::span<const Observed> observed) {
  std::vector<Block> blocks;
  std::vector<double> fastest;  // of the blocks' frames, in the calm scale
  std::vector<double> medians;
  for (const Observed& setting : observed) {
    if (setting.count() < kSeenThrice) continue;
    const double middle = middle_of(setting.frames);
    const auto n = static_cast<double>(setting.count());
    // Blocks lie closer to the centre of their own setting than to the true one.
    const double own = scale(setting);
    const double unit = std::sqrt(n / (n - 1)) / own;
    const double calm_unit = std::sqrt(n / (n - 1)) / calm_scale(setting, own);
    for (const double frame : setting.fastest) fastest.push_back((frame - middle) * calm_unit);
    for (const double frame : setting.medians) medians.push_back((frame - middle) * calm_unit);
    const std::size_t first = blocks.size();
    blocks.resize(first + setting.medians.size());
    std::vector<std::size_t> filled(setting.medians.size());
    for (std::size_t i = 0; i < setting.frames.size(); ++i) {
      const std::size_t block = setting.blocks[i];
      blocks[first + block][filled[block]++] = (setting.frames[i] - middle) * unit;  // by rising time, as frames are
    }
  }
  rank(above_.fastest, fastest);
  rank(above_.medians, medians);
  for (double& median : medians) median = -median;
  rank(below_.medians, medians);
  if (blocks.size() < kSeenThrice) return;
  if (blocks.size() > kMostTails) {
    std::vector<Block> fewer;
    for (std::size_t i = 0; i < kMostTails; ++i) fewer.push_back(blocks[i * blocks.size() / kMostTails]);
    blocks = std::move(fewer);
  }
  for (Block& block : blocks)
    for (double& frame : block) frame = std::clamp(frame, -kFastClip, kClip);
  double least = 0;
  for (const Block& block : blocks) least = std::min(least, block[0]);
  // One frame more extreme than any seen at either end.
  blocks.push_back({0, 0, kClip});
  blocks.push_back({std::max(1.5 * least, -kFastClip), 0, 0});
  fit_cumulants(blocks);
}

void NoiseModel::fit_cumulants(std::span<const Block> blocks) {
  std::vector<std::pair<double, std::size_t>> frames;  // with their block
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (const double frame : blocks[i]) frames.emplace_back(frame, i);
  std::ranges::sort(frames, {}, &std::pair<double, std::size_t>::first);
  std::vector<double> values;
  values.reserve(frames.size());
  for (const auto& [frame, block] : frames) values.push_back(frame);
  const std::vector<double> projection = median_projection(values);
  const double mean = std::accumulate(projection.begin(), projection.end(), 0.0) / static_cast<double>(values.size());
  std::vector<double> linear(blocks.size());
  for (std::size_t i = 0; i < frames.size(); ++i) linear[frames[i].second] += projection[i] - mean;

  std::vector<double> medians;
  medians.reserve(blocks.size());
  for (const Block& block : blocks) medians.push_back(block[1] - mean);
  std::vector<double> powers(blocks.size());
  const auto n = static_cast<double>(blocks.size());
  // Few blocks say little of the tails: psi is then no less than the normal one.
  const double normal = blocks.size() < kKnownTails ? design_effect() / 2 : 0;
  for (std::size_t j = 0; j < kRates; ++j) {
    const double rate = rates_[j];
    const auto set = [&](Cumulants Side::*cumulant, std::span<const double> deviations, double variance) {
      // exp of some hundreds: only where all others are identical; the radius is then huge in any case
      for (std::size_t i = 0; i < deviations.size(); ++i) powers[i] = std::clamp(rate * deviations[i], -300.0, 300.0);
      exp_of_each(powers);
      const double least = variance * normal * square(rate);
      const auto power = [&](int i) { return powers[static_cast<std::size_t>(i)]; };
      const double above = sum_of(static_cast<int>(powers.size()), power);
      const double below = sum_of(static_cast<int>(powers.size()), [&](int i) { return 1 / power(i); });
      (above_.*cumulant)[j] = std::max(least, std::log(above / n));
      (below_.*cumulant)[j] = std::max(least, std::log(below / n));
    };
    set(&Side::block, medians, kMedianVariance);
    set(&Side::linear, linear, kLinearVariance);
  }
}

void NoiseModel::rank(Beyond& side, std::span<double> values) const {
  double longest = 0;
  for (const std::array<double, kMostRanked>& tails : tails_) longest = std::max(longest, std::ranges::max(tails));
  sort_tail(values, longest);
  for (std::size_t tier = 0; tier < kTiers; ++tier)
    for (std::size_t i = 0; i < kMostRanked; ++i) side[tier][i] = beyond(values, tails_[tier][i]);
}

void NoiseModel::forget(Side& side) const {
  for (std::vector<double>& radius : side.radius)
    radius.assign(counts_.size(), std::numeric_limits<double>::quiet_NaN());
}

double NoiseModel::solved(const Side& side, std::size_t tier, int count) const {
  std::array<double, kRates> exponent{};
  const double target = log_alpha_[tier] + std::log(static_cast<double>(kRates));
  const Cumulants& cumulant = count < kLinear ? side.block : side.linear;
  // Newton on log sum exp(count (rate r - cumulant)) = target, convex and rising in r; started where one term alone
  // reaches the target, so from above.
  double r = kNoBound;
  for (std::size_t j = 0; j < kRates; ++j) r = std::min(r, (cumulant[j] + target / count) / rates_[j]);
  for (int step = 0; step < 20; ++step) {
    double most = -kNoBound;
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
  return r;
}

std::size_t NoiseModel::tier_of(const Observed& observed) const {
  std::size_t tier = 0;
  while (tier + 1 < kTiers && static_cast<std::size_t>(observed.order) >= tier_ends_[tier]) ++tier;
  return tier;
}

double NoiseModel::radius(const Side& side, const Observed& observed) const {
  const std::size_t tier = tier_of(observed);
  const int count = observed.count();
  // Between counts that were solved the radius falls with the root of the count, but for a share of a percent.
  const auto above = std::ranges::upper_bound(counts_, count);
  const auto index = static_cast<std::size_t>(above - counts_.begin()) - 1;
  double& radius = side.radius[tier][index];
  if (std::isnan(radius)) radius = solved(side, tier, counts_[index]);
  return radius * std::sqrt(static_cast<double>(counts_[index]) / count);
}

NoiseModel::Bounds NoiseModel::bound(Observed& observed) const {
  const double own = scale(observed);
  const double calm = calm_scale(observed, own);
  const std::vector<double>& frames = observed.frames;
  const auto count = static_cast<double>(frames.size());
  const double lowest = frames.front();
  const double highest = frames.back();
  // Frames beyond are outliers of this setting; a line is kept by three quarters of its frames being beyond, too.
  const double outlying = frames[frames.size() / 4] + kClip * calm;
  const double inlying = frames[frames.size() * 3 / 4] - kClip * calm;
  observed.mean = observed.count() < kSeenThrice ? observed.plain : observed.across;
  observed.clipped = highest > outlying ? mean_median(frames, lowest, outlying) : observed.plain;
  Bounds bounds{.block_deviation = block_deviation(own)};
  if (observed.count() < kSeenTwice) return bounds;

  // Of what frames beyond [low, high] contribute.
  const auto error_beyond = [&](double low, double high) {
    if (low <= lowest && high >= highest) return 0.0;
    const double beyond = median_variance(frames, lowest, highest) - median_variance(frames, low, high);
    return kOutlier * std::sqrt(std::max(0.0, beyond) * design_effect() / count);
  };
  const double slow_error = error_beyond(lowest, outlying);
  const std::size_t tier = tier_of(observed);
  const std::size_t ranked = std::min<std::size_t>(observed.medians.size(), kMostRanked) - 1;
  const auto outvoted = static_cast<std::size_t>(rank_of(observed.count())) - 1;
  const double least = std::max(observed.fastest[outvoted] - calm * above_.fastest[tier][ranked],
                                observed.medians[outvoted] - calm * above_.medians[tier][ranked]);
  const double most = observed.medians[observed.medians.size() - 1 - outvoted] + calm * below_.medians[tier][ranked];
  const double slow = least + kClip * calm;
  const double fast = std::min(most - kFastClip * own, highest);
  const double above = own * radius(above_, observed);
  const double below = own * radius(below_, observed) + slow_error;
  if (observed.count() < kSeenThrice) {
    const double lesser = std::min(slow, lesser_across_blocks(observed, lowest, std::max(slow, lowest)));
    bounds.lower = std::max(least, lesser - above);
    bounds.upper = greater_across_blocks(observed, fast, highest) + below;
    return bounds;
  }

  const auto across = [&](double low, double high) {
    return low <= lowest && high >= highest ? observed.across : median_across_blocks(observed, low, high);
  };
  double lower = std::min(slow, across(lowest, std::max(slow, lowest)));
  const auto slow_frames = static_cast<double>(frames.end() - std::ranges::upper_bound(frames, outlying));
  if (slow_frames >= kSeenOutliers * design_effect())
    lower += std::max(0.0, observed.across - across(lowest, std::max(slow, outlying)) - slow_error);
  double upper = across(fast, highest);
  const auto fast_frames = static_cast<double>(std::ranges::lower_bound(frames, inlying) - frames.begin());
  const double gained = fast_frames > 0 ? across(std::min(fast, inlying), highest) - observed.across : 0;
  if (fast_frames >= kSeenOutliers * design_effect()) upper -= std::max(0.0, gained - error_beyond(inlying, highest));
  // Ranks bound the middle of a setting's frames; many blocks show where its mean is.
  const double ranked_least = observed.count() < kLinear ? least - gained : -kNoBound;
  bounds.lower = std::max(ranked_least, lower - above);
  bounds.upper = upper + below;
  return bounds;
}

}  // namespace reliefbench
