#include "tuner/search/strategies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "kernels/base/error.h"
#include "tuner/search/improvement.h"
#include "tuner/search/rivals.h"
#include "tuner/search/search.h"

namespace reliefbench {
namespace {

StrategyAnswer ours(const SearchSpace& space, TimeSource& times, const StrategyTask& task) {
  const SearchResult result = search(space, times,
                                     {.seed = task.seed,
                                      .first = task.first,
                                      .max_samples = kPatience * std::ssize(space.candidates),
                                      .max_measured = task.max_timed});
  StrategyAnswer answer{.picks = {}, .timed = result.measured, .samples = result.samples};
  for (const BudgetAnswer& budget : result.answers) answer.picks.push_back(budget.pick);
  return answer;
}

constexpr std::array kStrategies{
    Strategy{"random", "settings in random order, 7 frames each", random_search},
    Strategy{"grid", "settings evenly spread over every axis, finer and finer, 7 frames each", grid_search},
    Strategy{"nsga2", "non-dominated sorting genetic algorithm II, 7 frames a setting", nsga2_search},
    Strategy{"local", "Pareto local search from the defaults, 7 frames a setting", local_search},
    Strategy{"ours", "Gaussian process, then a race with a certificate", ours},
};

}  // namespace

std::span<const Strategy> strategies() { return kStrategies; }

Judge::Judge(const RecordedTable& table) {
  std::vector<std::size_t> order;
  slowest_ = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < table.space.candidates.size(); ++i) {
    log_time_.push_back(true_log_time(table.samples.at(i)));
    error_.push_back(table.space.candidates[i].error);
    if (!table.space.candidates[i].is_feasible) continue;
    order.push_back(i);
    slowest_ = std::max(slowest_, log_time_.back());
  }
  if (order.empty()) fail_input("no setting of the table is feasible");
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return error_[a] != error_[b] ? error_[a] < error_[b] : log_time_[a] < log_time_[b];
  });
  for (const std::size_t i : order) {
    const bool is_new = budgets_.empty() || error_[i] > budgets_.back();
    if (front_.empty() || log_time_[i] < log_time_[front_.back()]) front_.push_back(i);
    if (!is_new) continue;  // a slower setting with the same error
    budgets_.push_back(error_[i]);
    best_.push_back(log_time_[front_.back()]);
  }
  std::ranges::reverse(front_);
}

Checkpoint Judge::judge(std::span<const std::size_t> picks) const {
  Checkpoint result;
  double area = 0;
  double whole = 0;
  std::size_t next = picks.size();  // picks before this one are too inaccurate for the budget
  for (std::size_t i = 0; i < budgets_.size(); ++i) {
    while (next > 0 && error_[picks[next - 1]] <= budgets_[i]) --next;
    whole += slowest_ - best_[i];
    if (next == picks.size()) {
      result.worst_regret = std::numeric_limits<double>::infinity();
      result.mean_regret = result.worst_regret;
      continue;
    }
    const double log_time = log_time_[picks[next]];
    area += slowest_ - log_time;
    const double regret = std::expm1(log_time - best_[i]);
    result.worst_regret = std::max(result.worst_regret, regret);
    result.mean_regret += regret / static_cast<double>(budgets_.size());
  }
  result.hypervolume = whole > 0 ? area / whole : 1;
  int false_picks = 0;
  for (const std::size_t pick : picks) {
    const auto budget = std::ranges::upper_bound(budgets_, error_[pick]) - budgets_.begin() - 1;
    if (log_time_[pick] - best_[static_cast<std::size_t>(budget)] > std::log1p(kFalseFront)) ++false_picks;
  }
  if (!picks.empty()) result.false_front = static_cast<double>(false_picks) / static_cast<double>(picks.size());
  return result;
}

std::vector<Checkpoint> evaluate(const RecordedTable& table, const Judge& judge, const Strategy& strategy,
                                 const StrategyTask& task, std::span<const double> shares) {
  const auto settings = static_cast<double>(table.space.candidates.size());
  std::vector<Checkpoint> checkpoints;
  for (const double share : shares) {
    StrategyTask limited = task;
    limited.max_timed = share < 1 ? std::max(1, static_cast<int>(std::floor(share * settings))) : 0;
    ReplaySource times(table, task.seed);
    const StrategyAnswer answer = strategy.run(table.space, times, limited);
    Checkpoint checkpoint = judge.judge(answer.picks);
    checkpoint.share_timed = share;
    checkpoint.timed = answer.timed;
    checkpoint.samples = answer.samples;
    checkpoints.push_back(checkpoint);
  }
  return checkpoints;
}

}  // namespace reliefbench
