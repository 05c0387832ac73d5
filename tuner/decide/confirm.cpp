#include "tuner/decide/confirm.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kDoubt = 0.05;

std::set<std::string> keys_in_all(std::span<const Rerun> reruns) {
  std::set<std::string> keys;
  for (const auto& entry : reruns.front().log_values)
    if (std::ranges::all_of(reruns, [&](const Rerun& rerun) { return rerun.log_values.contains(entry.first); }))
      keys.insert(entry.first);
  return keys;
}

double mean_of(const Rerun& rerun, const std::set<std::string>& keys) {
  double sum = 0;
  for (const std::string& key : keys) sum += rerun.log_values.at(key);
  return sum / static_cast<double>(keys.size());
}

}  // namespace

std::string rerun_key(const SeriesRow& series) { return series.setting + ' ' + series.metric; }

RerunStep rerun_step(std::span<const Rerun> reruns, const std::set<std::string>& keys, double confidence) {
  // Least squares on the build (+-1/2) and the time (centred). The order makes both orthogonal to each other and to 1.
  const auto n = static_cast<double>(reruns.size());
  std::vector<double> values;
  double mean = 0;
  for (const Rerun& rerun : reruns) {
    values.push_back(mean_of(rerun, keys));
    mean += values.back() / n;
  }
  double step = 0;
  double slope = 0;
  double time_squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double time = static_cast<double>(i) - (n - 1) / 2;
    step += values[i] * (reruns[i].is_bad ? 2 : -2) / n;
    slope += values[i] * time;
    time_squares += time * time;
  }
  slope /= time_squares;
  double squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double time = static_cast<double>(i) - (n - 1) / 2;
    const double residual = values[i] - mean - step * (reruns[i].is_bad ? 0.5 : -0.5) - slope * time;
    squares += residual * residual;
  }
  const int df = static_cast<int>(reruns.size()) - 3;
  const double margin = student_t_quantile(1 - confidence, df) * std::sqrt(squares / df * 4 / n);
  return {.log_ratio = step, .low = step - margin, .high = step + margin};
}

RerunAnswer judge_reruns(std::span<const Rerun> reruns, double log_ratio) {
  const std::set<std::string> keys = keys_in_all(reruns);
  if (keys.empty()) fail_input("no case of the event was measured in all re-runs: do the commands measure them?");
  const RerunStep step = rerun_step(reruns, keys, 1 - kDoubt);
  RerunAnswer answer{
      .log_ratio = step.log_ratio, .low = step.low, .high = step.high, .series = keys.size(), .state = std::nullopt};
  const double side = log_ratio > 0 ? 1 : -1;
  const double near = std::min(side * answer.low, side * answer.high);
  const double far = std::max(side * answer.low, side * answer.high);
  if (far < std::abs(log_ratio) / 2)
    answer.state = EventState::cleared;
  else if (near > 0)
    answer.state = EventState::confirmed;
  return answer;
}

}  // namespace reliefbench
