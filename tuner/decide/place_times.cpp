#include "tuner/decide/place_times.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "tuner/decide/log_ratio.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kMedianEfficiency = 0.37;  // of the median of squares, beside the mean of squares

/// A setting in one run.
struct RunTime {
  const TableRow* row = nullptr;
  double log_time = 0;
  double sample_variance = 0;
  double variance = 0;  ///< of log_time, moderated
  double df = 0;
  std::vector<double> errors;
};
using SettingTimes = std::map<std::string, RunTime>;

RunTime run_time(const TableRow& row, std::string_view run) {
  if (row.samples_ns.size() < 2)
    fail_input("{}: case '{}' has {} samples; at least two say how sure a time is", run, row.case_id,
               row.samples_ns.size());
  std::vector<double> logs;
  for (const double time : row.samples_ns) logs.push_back(std::log(time));
  Location location = huber_location(logs);
  const auto n = static_cast<double>(logs.size());
  double squares = 0;
  for (double& influence : location.influence) {
    squares += influence * influence;
    influence *= std::sqrt(n / (n - 1)) / n;
  }
  return {.row = &row,
          .log_time = location.value,
          .sample_variance = squares / (n - 1),
          .df = n - 1,
          .errors = std::move(location.influence)};
}

/// Lets the settings of all runs borrow strength from each other.
void moderate(std::vector<SettingTimes>& runs) {
  std::vector<double> variances;
  std::vector<int> df;
  for (const SettingTimes& run : runs)
    for (const auto& [id, time] : run) {
      variances.push_back(time.sample_variance);
      df.push_back(static_cast<int>(time.df));
    }
  const VariancePrior prior = variance_prior(variances, df);
  for (SettingTimes& run : runs)
    for (auto& [id, time] : run) {
      const auto n = static_cast<double>(time.errors.size());
      time.variance = prior.moderated(time.sample_variance, time.df) / n;
      time.df = std::min<double>(prior.df + time.df, kMostDf);
    }
}

/// The differences of two runs of a place, setting by setting.
struct RunStep {
  double centre = 0;  ///< what the second run has more
  std::vector<Residual> residuals;
};
RunStep step_between(const SettingTimes& first, const SettingTimes& second) {
  std::vector<double> differences;
  std::vector<double> variances;
  for (const auto& [id, time] : first) {
    const auto other = second.find(id);
    if (other == second.end()) continue;
    differences.push_back(other->second.log_time - time.log_time);
    variances.push_back(other->second.variance + time.variance);
  }
  if (differences.empty()) return {};
  RunStep step{.centre = median(differences), .residuals = {}};
  const auto n = static_cast<double>(differences.size());
  for (std::size_t i = 0; n > 1 && i < differences.size(); ++i) {
    const double distance = differences[i] - step.centre;
    step.residuals.push_back({.square = distance * distance * n / (n - 1), .variance = variances[i]});
  }
  return step;
}

/// What shifts the cases of the runs, together and each by itself.
struct RunShifts {
  std::vector<double> shared;      ///< of each run, about their mean
  std::optional<double> variance;  ///< of a case by itself
  double df = 0;
};
RunShifts shifts_of(std::span<const SettingTimes> runs) {
  RunShifts shifts{.shared = {0}, .variance = std::nullopt};
  std::vector<Residual> residuals;
  double mean = 0;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    RunStep step = step_between(runs[k - 1], runs[k]);
    shifts.shared.push_back(shifts.shared.back() + step.centre);
    mean += shifts.shared.back() / static_cast<double>(runs.size());
    residuals.insert(residuals.end(), step.residuals.begin(), step.residuals.end());
  }
  for (double& shift : shifts.shared) shift -= mean;
  if (residuals.empty()) return shifts;
  shifts.variance = excess_variance(residuals) / 2;  // a difference has that of two runs
  shifts.df = std::max(1.0, kMedianEfficiency * static_cast<double>(residuals.size()));
  return shifts;
}

/// Degrees of freedom of a sum of two estimated variances. source: Satterthwaite, "An approximate distribution of
/// estimates of variance components", 1946
double df_of_sum(double a, double df_a, double b, double df_b) {
  if (a + b <= 0) return std::max(df_a, 1.0);
  const double parts = (df_a > 0 ? a * a / df_a : 0) + (df_b > 0 ? b * b / df_b : 0);
  return std::clamp((a + b) * (a + b) / parts, 1.0, static_cast<double>(kMostDf));
}

SettingTime mean_time(const std::string& id, std::span<const SettingTimes> runs, const RunShifts& shifts) {
  SettingTime mean;
  double df = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const auto found = runs[k].find(id);
    if (found == runs[k].end()) continue;
    const RunTime& time = found->second;
    mean.log_time += time.log_time - shifts.shared[k];
    mean.variance += time.variance;
    df += time.df;
    mean.errors.push_back(time.errors);
    mean.rows.push_back(time.row);
  }
  const auto n = static_cast<double>(mean.rows.size());
  mean.log_time /= n;
  mean.variance /= n * n;
  for (std::vector<double>& run : mean.errors)
    for (double& error : run) error /= n;
  const double shift = shifts.variance.value_or(0) / n;
  mean.df = df_of_sum(mean.variance, std::min<double>(df, kMostDf), shift, shifts.df);
  mean.variance += shift;
  return mean;
}

}  // namespace

PlaceTimes place_times(const MeasuredPlace& place, std::span<const FleetRun> runs,
                       const std::function<bool(const TableRow&)>& counts) {
  std::vector<SettingTimes> times;
  for (std::size_t k = 0; k < place.runs.size(); ++k) {
    times.emplace_back();
    for (const TableRow* row : place.cases[k])
      if (counts(*row)) times.back().emplace(setting_id(row->settings), run_time(*row, runs[place.runs[k]].name));
    if (times.back().empty()) times.pop_back();
  }
  moderate(times);
  const RunShifts shifts = shifts_of(times);
  PlaceTimes result{.settings = {}, .runs = times.size(), .between_runs = {}, .shared_variance = {}};
  for (const SettingTimes& run : times)
    for (const auto& [id, time] : run)
      if (!result.settings.contains(id)) result.settings.emplace(id, mean_time(id, times, shifts));
  if (!shifts.variance) return result;
  result.between_runs = std::sqrt(*shifts.variance);
  const auto n = static_cast<double>(times.size());
  double squares = 0;
  for (const double shift : shifts.shared) squares += shift * shift;
  result.shared_variance = squares / (n * (n - 1));
  return result;
}

}  // namespace reliefbench
