#include "tuner/decide/place_times.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include "kernels/base/error.h"
#include "tuner/decide/log_ratio.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kFitRounds = 10'000;  // of backfitting; two runs need one
constexpr double kFitRest = 1e-12;  // of a log: what a round may still move

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
  std::size_t first = 0;
  std::size_t second = 0;
  double centre = 0;  ///< what the second run has more
  double weight = 0;  ///< settings that both have
};

/// How far a setting's difference is from its step's centre, and which share of an independent one that is: of the
/// pairs of n runs n - 1 are.
struct Departure {
  Residual residual;
  double share = 1;
};

/// How many runs have each setting.
std::map<std::string_view, std::size_t> run_counts(std::span<const SettingTimes> runs) {
  std::map<std::string_view, std::size_t> counts;
  for (const SettingTimes& run : runs)
    for (const auto& [id, time] : run) ++counts[id];
  return counts;
}

/// What shifts the cases of the runs, together and each by itself.
struct RunShifts {
  std::vector<double> shared;      ///< of each run, about the mean of those that it can be held to
  double shared_df = 0;            ///< of their variance
  std::optional<double> variance;  ///< of a case by itself
  double df = 0;
};

class ShiftFit {
 public:
  explicit ShiftFit(std::span<const SettingTimes> runs) : runs_(runs), counts_(run_counts(runs)) {
    for (std::size_t second = 0; second < runs.size(); ++second)
      for (std::size_t first = 0; first < second; ++first) add_step(first, second);
  }

  [[nodiscard]] RunShifts fit() const {
    RunShifts shifts{.shared = fitted(), .variance = std::nullopt};
    shifts.shared_df = static_cast<double>(runs_.size() - take_means(shifts.shared));
    if (departures_.empty()) return shifts;
    std::vector<Residual> residuals;
    double independent = 0;
    for (const Departure& departure : departures_) {
      residuals.push_back(departure.residual);
      independent += departure.share;
    }
    shifts.variance = excess_variance(residuals) / 2;  // a difference has that of two runs
    shifts.df = excess_df(independent);
    return shifts;
  }

 private:
  void add_step(std::size_t first, std::size_t second) {
    std::vector<double> differences;
    std::vector<double> variances;
    std::vector<double> shares;
    for (const auto& [id, time] : runs_[first]) {
      const auto other = runs_[second].find(id);
      if (other == runs_[second].end()) continue;
      differences.push_back(other->second.log_time - time.log_time);
      variances.push_back(other->second.variance + time.variance);
      shares.push_back(2 / static_cast<double>(counts_.at(id)));
    }
    if (differences.empty()) return;
    const double centre = median(differences);
    const auto n = static_cast<double>(differences.size());
    steps_.push_back({.first = first, .second = second, .centre = centre, .weight = n});
    for (std::size_t i = 0; n > 1 && i < differences.size(); ++i) {
      const double distance = differences[i] - centre;
      departures_.push_back(
          {.residual = {.square = distance * distance * n / (n - 1), .variance = variances[i]}, .share = shares[i]});
    }
  }

  /// Of each run the first that it can be held to, through others where the two share no setting.
  [[nodiscard]] std::vector<std::size_t> groups() const {
    std::vector<std::size_t> group_of(runs_.size());
    std::iota(group_of.begin(), group_of.end(), std::size_t{0});
    for (const RunStep& step : steps_) {
      const std::size_t kept = std::min(group_of[step.first], group_of[step.second]);
      const std::size_t joining = std::max(group_of[step.first], group_of[step.second]);
      std::ranges::replace(group_of, joining, kept);
    }
    return group_of;
  }

  /// Fitted to all steps by least squares, each with the weight of its settings: by backfitting, half the way a round,
  /// so that two runs do not change sides for ever.
  [[nodiscard]] std::vector<double> fitted() const {
    std::vector<double> shifts(runs_.size());
    double moved = 1;
    for (int round = 0; round < kFitRounds && moved > kFitRest; ++round) {
      std::vector<double> sums(runs_.size());
      std::vector<double> weights(runs_.size());
      for (const RunStep& step : steps_) {
        sums[step.first] += step.weight * (shifts[step.second] - step.centre - shifts[step.first]);
        sums[step.second] += step.weight * (shifts[step.first] + step.centre - shifts[step.second]);
        weights[step.first] += step.weight;
        weights[step.second] += step.weight;
      }
      moved = 0;
      for (std::size_t run = 0; run < runs_.size(); ++run) {
        const double way = weights[run] > 0 ? sums[run] / weights[run] / 2 : 0;
        shifts[run] += way;
        moved = std::max(moved, std::abs(way));
      }
    }
    return shifts;
  }

  /// Takes the mean of each group from its shifts. returns: how many groups there are
  std::size_t take_means(std::vector<double>& shifts) const {
    const std::vector<std::size_t> group_of = groups();
    std::map<std::size_t, std::vector<double>> members;
    for (std::size_t run = 0; run < shifts.size(); ++run) members[group_of[run]].push_back(shifts[run]);
    for (std::size_t run = 0; run < shifts.size(); ++run) {
      const std::vector<double>& own = members.at(group_of[run]);
      shifts[run] -= std::accumulate(own.begin(), own.end(), 0.0) / static_cast<double>(own.size());
    }
    return members.size();
  }

  std::span<const SettingTimes> runs_;
  std::map<std::string_view, std::size_t> counts_;
  std::vector<RunStep> steps_;
  std::vector<Departure> departures_;
};

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
  const RunShifts shifts = ShiftFit(times).fit();
  PlaceTimes result{.settings = {}, .between_runs = {}, .shared_variance = {}};
  for (const SettingTimes& run : times)
    for (const auto& [id, time] : run)
      if (!result.settings.contains(id)) result.settings.emplace(id, mean_time(id, times, shifts));
  if (!shifts.variance) return result;
  result.between_runs = std::sqrt(*shifts.variance);
  double squares = 0;
  for (const double shift : shifts.shared) squares += shift * shift;
  result.shared_variance = squares / (shifts.shared_df * static_cast<double>(times.size()));
  result.shared_df = shifts.shared_df;
  return result;
}

}  // namespace reliefbench
