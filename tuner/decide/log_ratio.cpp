#include "tuner/decide/log_ratio.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kMedianOfSquare = 0.4549;  // of a standard normal variable
constexpr double kMedianEfficiency = 0.37;  // of the median of squares, beside the mean of squares

int whole_df(double df) { return static_cast<int>(std::min<double>(df, kMostDf)); }

double sum_of_squares(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return sum;
}

}  // namespace

double excess_variance(std::span<const Residual> residuals) {
  if (residuals.empty()) return 0;
  const auto median_with = [&](double excess) {
    std::vector<double> ratios;
    for (const Residual& residual : residuals) {
      const double variance = residual.variance + excess;
      ratios.push_back(variance > 0 ? residual.square / variance : (residual.square > 0 ? INFINITY : 0));
    }
    return median(ratios);
  };
  double low = 0;
  if (median_with(low) <= kMedianOfSquare) return low;
  double high = 0;
  for (const Residual& residual : residuals) high = std::max(high, residual.square / kMedianOfSquare);
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (median_with(middle) > kMedianOfSquare ? low : high) = middle;
  }
  return low;
}

double excess_df(double independent) { return std::max(1.0, kMedianEfficiency * independent); }

double LogRatio::p() const {
  if (df < 1) return 1;
  if (error == 0) return mean == 0 ? 1 : std::numeric_limits<double>::epsilon();
  return student_t_p(mean / error, df);
}

double LogRatio::margin(double confidence) const {
  if (df < 1) return INFINITY;
  return error == 0 ? 0 : error * student_t_quantile(1 - confidence, df);
}

LogRatios::LogRatios(std::span<const RatioCase> cases) {
  std::vector<double> variances;
  std::vector<int> df;
  for (const RatioCase& c : cases) {
    const Location base = huber_location(c.base.logs);
    const Location now = huber_location(c.now.logs);
    const int own_df = static_cast<int>(c.base.logs.size() + c.now.logs.size()) - 2;
    const double squares = sum_of_squares(base.influence) + sum_of_squares(now.influence);
    const auto part = [&](const LoggedTimes& times, const Location& location) {
      Part result{.errors = location.influence, .rounds = times.rounds, .block = times.block};
      const auto n = static_cast<double>(times.logs.size());
      // n / (n - 1): the influences are about their own mean.
      const double scale = c.is_same_measurement || n < 2 ? 0 : std::sqrt(n / (n - 1)) / n;
      for (double& error : result.errors) error *= scale;
      return result;
    };
    entries_.push_back({.base = part(c.base, base),
                        .now = part(c.now, now),
                        .mean = now.value - base.value,
                        .variance = own_df > 0 ? squares / own_df : 0,
                        .df = own_df,
                        .shifts = c.is_same_measurement ? 0.0 : 1.0});
    if (c.is_same_measurement) continue;
    variances.push_back(entries_.back().variance);
    df.push_back(own_df);
  }
  const VariancePrior prior = variance_prior(variances, df);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Entry& entry = entries_[i];
    const double samples =
        1 / static_cast<double>(cases[i].base.logs.size()) + 1 / static_cast<double>(cases[i].now.logs.size());
    const bool is_known = prior.df + entry.df > 0;
    entry.variance = is_known ? entry.shifts * prior.moderated(entry.variance, entry.df) * samples : INFINITY;
    entry.df = entry.shifts == 0 ? kMostDf : whole_df(prior.df + entry.df);
  }
  set_between_runs(cases);
}

void LogRatios::set_between_runs(std::span<const RatioCase> cases) {
  std::map<std::string, std::vector<const Entry*>, std::less<>> families;
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (entries_[i].shifts > 0) families[cases[i].family].push_back(&entries_[i]);
  std::vector<Residual> residuals;
  std::size_t independent = 0;
  for (const auto& [family, members] : families) {
    if (members.size() < 2) continue;  // is its own median
    independent += members.size() - 1;
    std::vector<double> means;
    for (const Entry* entry : members) means.push_back(entry->mean);
    const double centre = median(means);
    const auto n = static_cast<double>(members.size());
    for (const Entry* entry : members) {
      const double distance = entry->mean - centre;
      residuals.push_back({.square = distance * distance * n / (n - 1), .variance = entry->variance});
    }
  }
  between_runs_ = std::sqrt(excess_variance(residuals));
  between_runs_df_ = excess_df(static_cast<double>(independent));
}

LogRatio LogRatios::of_one(const Entry& entry) const {
  const double shift = entry.shifts * between_runs_;
  const double variance = entry.variance + shift * shift;
  return {.mean = entry.mean,
          .error = std::sqrt(variance),
          .df = entry.df == 0 ? 0 : whole_df(df_of_sum(entry.variance, entry.df, shift * shift, between_runs_df_)),
          .shift = shift};
}

LogRatio LogRatios::of(std::span<const std::size_t> cases) const {
  if (cases.size() == 1) return of_one(entries_[cases.front()]);
  const auto n = static_cast<double>(cases.size());
  double mean = 0;
  double independent = 0;  // sampling variance if no round were shared
  double shifts = 0;       // share of the cases that were measured twice
  for (const std::size_t i : cases) {
    mean += entries_[i].mean / n;
    independent += entries_[i].variance / (n * n);
    shifts += entries_[i].shifts / n;
  }
  double by_rounds = 0;
  std::size_t df = 0;
  std::size_t fewest_blocks = cases.size();
  for (const auto run : {&Entry::base, &Entry::now}) {
    std::map<int, double> errors;
    std::set<int> blocks;
    for (const std::size_t i : cases) {
      const Part& part = entries_[i].*run;
      blocks.insert(part.block);
      for (std::size_t k = 0; k < part.errors.size(); ++k) errors[part.rounds[k]] += part.errors[k] / n;
    }
    for (const auto& [round, error] : errors) by_rounds += error * error;
    df += errors.size() - std::min(errors.size(), blocks.size());
    fewest_blocks = std::min(fewest_blocks, blocks.size());
  }
  double spread = 0;
  for (const std::size_t i : cases) spread += (entries_[i].mean - mean) * (entries_[i].mean - mean) / (n * (n - 1));
  const double shift = shifts * between_runs_;
  const double shift_variance = shift * shift / static_cast<double>(fewest_blocks);
  const double sampling = std::max(by_rounds, independent);
  const double variance = sampling + shift_variance;
  LogRatio ratio{
      .mean = mean,
      .error = std::sqrt(variance),
      .df = df == 0 ? 0 : whole_df(df_of_sum(sampling, static_cast<double>(df), shift_variance, between_runs_df_)),
      .shift = std::sqrt(shift_variance)};
  if (cases.size() >= kSpread && spread > variance) {
    ratio.error = std::sqrt(spread);
    ratio.df = std::min(ratio.df, static_cast<int>(cases.size()) - 1);
  }
  if (shifts == 0) ratio.df = kMostDf;
  return ratio;
}

}  // namespace reliefbench
