#include "tuner/decide/changes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "tuner/decide/drift.h"
#include "tuner/decide/level_fit.h"
#include "tuner/decide/null_gain.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr std::size_t kFewestOfLevel = 4;   // what the null table was made with
constexpr double kLeastLogNoise = 1e-6;     // of a log: what a double's sums are good for, and no clock is
constexpr double kFalseSteps = 0.0005;      // series of a look that show a step and have none
constexpr double kFalseDrifts = 0.001;      // series of a look that show a drift and have none
constexpr std::size_t kSoon = 5;            // nights within which smallest_shift would be found
constexpr double kNinetyPercent = 1.2816;   // of a normal distribution
constexpr std::size_t kNightsOfDrift = 20;  // that show one

/// Noise that a night's log value has at least: its standard error within the night.
double noise_floor(std::span<const double> standard_errors) {
  std::vector<double> known;
  for (const double error : standard_errors)
    if (error > 0) known.push_back(error);
  return known.empty() ? kLeastLogNoise : std::max(median(known), kLeastLogNoise);
}

/// A fit to the nights that are kept, with them.
struct NightFit {
  std::vector<std::size_t> nights;
  std::vector<double> values;
  LevelFit fit;

  [[nodiscard]] std::size_t first_night(std::size_t level) const {
    return level == 0 ? 0 : nights[fit.starts()[level]];
  }
};

NightFit fit_nights(std::span<const double> log_values, std::span<const std::size_t> spikes, std::size_t least,
                    double floor) {
  std::vector<std::size_t> nights = all_but(spikes, log_values.size());
  std::vector<double> values;
  values.reserve(nights.size());
  for (const std::size_t night : nights) values.push_back(log_values[night]);
  LevelFit fit(values, least, floor);
  return {.nights = std::move(nights), .values = std::move(values), .fit = std::move(fit)};
}

double deviation_of_step(const LevelFit& fit, std::size_t level) {
  return std::sqrt(fit.mean_variance(level) + fit.mean_variance(level - 1));
}

Shift shift_into(const NightFit& kept, std::size_t level, const ChangeOptions& options) {
  const LevelFit& fit = kept.fit;
  const LevelFit::Range range = fit.start_range(level);
  const double step = fit.mean(level) - fit.mean(level - 1);
  const double margin = student_t_quantile(1 - options.confidence, fit.df()) * deviation_of_step(fit, level);
  const double least = std::log1p(options.least_effect);
  return {.at = kept.nights[fit.starts()[level]],
          .earliest = kept.nights[range.first - 1] + 1,
          .latest = kept.nights[range.last],
          .log_ratio = step,
          .low = step - margin,
          .high = step + margin,
          .p = null_p(fit.gain(level), kept.nights.size()),
          .matters = step - margin > least || step + margin < -least};
}

double squares_about_levels(const NightFit& kept) {
  double squares = 0;
  for (std::size_t level = 0; level < kept.fit.starts().size(); ++level) {
    const double mean = kept.fit.mean(level);
    for (std::size_t i = kept.fit.starts()[level]; i < kept.fit.end(level); ++i)
      squares += (kept.values[i] - mean) * (kept.values[i] - mean);
  }
  return squares;
}

/// Schwarz's criterion: the less the better.
double criterion(double squares, std::size_t n, std::size_t parameters, double floor) {
  const auto count = static_cast<double>(n);
  return count * std::log(std::max(squares / count, floor * floor)) + static_cast<double>(parameters) * std::log(count);
}

/// Whether a line is the better account than these levels: of a level count its value and its start.
bool is_line_better(const NightFit& kept, double floor) {
  const std::size_t n = kept.values.size();
  const std::size_t levels = kept.fit.starts().size();
  return criterion(squares_about_line(kept.nights, kept.values), n, 2, floor) <
         criterion(squares_about_levels(kept), n, 2 * levels - 1, floor);
}

/// The step that a level of kSoon nights after the last one would have to be: to be told, and for its interval to
/// exclude the least effect.
double smallest_shift_after(const NightFit& kept, const ChangeOptions& options) {
  const LevelFit& fit = kept.fit;
  const std::size_t last = fit.starts().size() - 1;
  const double variance = fit.sigma() * fit.sigma() * mean_inflation(kSoon, fit.autocorrelation()) / double{kSoon};
  const double deviation = std::sqrt(variance + fit.mean_variance(last));
  const double told = std::sqrt(null_gain(std::min(kFalseSteps, options.told_p), kept.nights.size())) * deviation;
  const double margin = student_t_quantile(1 - options.confidence, fit.df()) * deviation;
  return std::expm1(std::max(told, std::log1p(options.least_effect) + margin) + kNinetyPercent * deviation);
}

}  // namespace

SeriesChanges find_changes(std::span<const double> log_values, std::span<const double> standard_errors,
                           const ChangeOptions& options) {
  assert(standard_errors.size() == log_values.size());
  SeriesChanges changes;
  if (log_values.empty()) return changes;
  const std::size_t least = std::max(options.least_nights, kFewestOfLevel);
  const double floor = noise_floor(standard_errors);
  changes.spikes = lone_values(log_values, least, floor);
  NightFit kept = fit_nights(log_values, changes.spikes, least, floor);
  const double least_gain = null_gain(kFalseSteps, kept.nights.size());
  kept.fit.keep_gains_of(least_gain);
  if (kept.nights.size() >= kNightsOfDrift && is_line_better(kept, floor))
    changes.drift = find_drift(kept.nights, kept.values, kFalseDrifts, options.confidence);
  if (changes.drift) kept.fit.keep_gains_of(std::numeric_limits<double>::infinity());

  const LevelFit& fit = kept.fit;
  for (std::size_t level = 0; level < fit.starts().size(); ++level) {
    const bool is_last = level + 1 == fit.starts().size();
    changes.levels.push_back({.first = kept.first_night(level),
                              .end = is_last ? log_values.size() : kept.first_night(level + 1),
                              .log_value = fit.mean(level),
                              .standard_error = std::sqrt(fit.mean_variance(level))});
    if (level > 0) changes.shifts.push_back(shift_into(kept, level, options));
  }
  changes.sigma = fit.sigma();
  if (changes.drift)
    changes.sigma =
        std::sqrt(squares_about_line(kept.nights, kept.values) / static_cast<double>(kept.nights.size() - 2));
  changes.autocorrelation = fit.autocorrelation();
  changes.smallest_shift = smallest_shift_after(kept, options);
  return changes;
}

}  // namespace reliefbench
