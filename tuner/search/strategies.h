#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "tuner/search/recorded_table.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// What a strategy may spend and where it starts.
struct StrategyTask {
  std::uint64_t seed = 1;
  std::vector<std::size_t> first{};  ///< settings that are timed first: the simplest of each technique
  int max_timed = 0;                 ///< settings; 0: as many as it wants
};

struct StrategyAnswer {
  std::vector<std::size_t> picks;  ///< by falling error and rising time: each answers budgets from its own error up
  int timed = 0;                   ///< settings
  std::int64_t samples = 0;        ///< frames drawn
};

/// A way to look for the front. One row each; all see the same space and the same source of times.
struct Strategy {
  std::string_view id;
  std::string_view description;
  StrategyAnswer (*run)(const SearchSpace& space, TimeSource& times, const StrategyTask& task);
};
/// random, grid, nsga2, local, ours
[[nodiscard]] std::span<const Strategy> strategies();

/// How good a strategy's answer is when it has timed so many settings; judged by the table's true times.
struct Checkpoint {
  double share_timed = 0;  ///< asked for
  int timed = 0;           ///< settings, in fact
  std::int64_t samples = 0;
  double worst_regret = 0;  ///< over the budgets: true time of the pick / least true time - 1; infinite without a pick
  double mean_regret = 0;
  double hypervolume = 0;  ///< of the picks / of the exhaustive front
  double false_front = 0;  ///< share of picks more than kFalseFront slower than the best within their own error
};
inline constexpr double kFalseFront = 0.02;

/// True front of a table, and what it takes to judge answers by it. Every distinct error of a feasible setting is one
/// budget. The hypervolume is that under the front in (rank of the budget, log time), with the slowest feasible
/// setting's time as reference point: the mean over the budgets of log(slowest / time of the answer). Ranks instead of
/// errors make it the same for any monotone scale of the error. A budget without an answer adds nothing.
class Judge {
 public:
  /// throws: Error(bad_input): nothing feasible
  explicit Judge(const RecordedTable& table);
  /// Fills in all but share_timed, timed and samples.
  [[nodiscard]] Checkpoint judge(std::span<const std::size_t> picks) const;
  [[nodiscard]] std::span<const double> true_log_times() const { return log_time_; }
  [[nodiscard]] std::span<const std::size_t> front() const { return front_; }  ///< by falling error

 private:
  std::vector<double> log_time_;
  std::vector<double> error_;    ///< one a candidate
  std::vector<double> budgets_;  ///< rising
  std::vector<double> best_;     ///< least true log time within each budget
  std::vector<std::size_t> front_;
  double slowest_ = 0;
};

/// Runs a strategy on replay, once for each share of the table's settings that it may time (1: until it ends).
[[nodiscard]] std::vector<Checkpoint> evaluate(const RecordedTable& table, const Judge& judge, const Strategy& strategy,
                                               const StrategyTask& task, std::span<const double> shares);

}  // namespace reliefbench
