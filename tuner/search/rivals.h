#pragma once
#include <cstddef>
#include <vector>

#include "tuner/search/strategies.h"

namespace reliefbench {

/// The usual practice: each setting is timed once, with kUsualFrames frames, and the least median wins.
class UsualTiming {
 public:
  static constexpr int kUsualFrames = 7;

  UsualTiming(const SearchSpace& space, TimeSource& times, const StrategyTask& task);
  /// Times a setting that is feasible and not yet timed; false if the task is done.
  bool measure(std::size_t candidate);
  [[nodiscard]] bool is_done() const;
  [[nodiscard]] bool is_open(std::size_t candidate) const;  ///< feasible and not yet timed
  [[nodiscard]] double log_time(std::size_t candidate) const { return log_time_[candidate]; }
  [[nodiscard]] const std::vector<std::size_t>& timed() const { return timed_; }  ///< in the order timed
  [[nodiscard]] StrategyAnswer answer() const;                                    ///< the front of what was timed

 private:
  const SearchSpace& space_;
  TimeSource& times_;
  std::size_t most_;
  std::vector<double> log_time_;  // median; NaN where not timed
  std::vector<std::size_t> timed_;
};

[[nodiscard]] StrategyAnswer random_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task);
/// Settings whose place on every step axis of their chain is a multiple of a power of two, in random order, the power
/// falling to one.
[[nodiscard]] StrategyAnswer grid_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task);
/// source: Deb, Pratap, Agarwal & Meyarivan, "A fast and elitist multiobjective genetic algorithm: NSGA-II", 2002.
/// Children take each axis from either parent, then some move on it; each becomes the nearest setting not yet timed.
[[nodiscard]] StrategyAnswer nsga2_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task);
/// source: Paquete, Chiarandini & Stutzle, "Pareto local optimum sets in the biobjective travelling salesman problem",
/// 2004. Visits the neighbours of each setting on the front of what was timed; where all were, a random setting.
[[nodiscard]] StrategyAnswer local_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task);

/// Front number of each point, 0 for the non-dominated, and crowding distance within its front. Both minimised.
struct Ranked {
  int front = 0;
  double crowding = 0;
};
[[nodiscard]] std::vector<Ranked> non_dominated_sort(std::span<const double> error, std::span<const double> time);

}  // namespace reliefbench
