#pragma once
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tuner/search/regret.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// The gap of an error budget and the two settings that decide it. The pick of a budget has the least upper
/// bound, its rival the least lower bound of the others: were the pick itself the best, it would cost nothing, so its
/// own lower bound does not count.
struct WideGap {
  double log_gap = std::numeric_limits<double>::infinity();  ///< pick's upper - rival's lower bound, log time; >= 0
  std::size_t pick = 0;                                      ///< if its upper bound is known, else the gap is infinite
  std::size_t rival = 0;
  double budget = 0;  ///< error
};

/// Bounds on log time of the feasible settings, kept by rising error, so that what is feasible within a budget is a
/// prefix and one scan finds the gap of every budget. Where a bound is unknown it is infinite.
///
/// With a regret rule only two things are asked: the fastest of all, which is the last budget's answer, and the setting
/// of least regret. That one lies on the front, as regret rises with error and time; a budget that can't hold it, by
/// the bounds so far, has no gap.
class Gaps {
 public:
  explicit Gaps(const SearchSpace& space, const std::optional<RegretRule>& regret = std::nullopt);
  void set(std::size_t candidate, double lower, double upper);
  [[nodiscard]] double lower(std::size_t candidate) const { return lower_[place_[candidate]]; }
  [[nodiscard]] double upper(std::size_t candidate) const { return upper_[place_[candidate]]; }

  /// O(n). Of budgets with equal gaps, the tightest.
  [[nodiscard]] WideGap widest() const;
  /// Gaps wider than log_gap, each once, the widest first, at most so many. O(n)
  [[nodiscard]] std::vector<WideGap> wider_than(double log_gap, std::size_t most) const;

  /// Settings within the gap's budget, but for its pick and its rival, by rising lower bound, as far as that is less
  /// than `lower`; at most so many. O(n)
  [[nodiscard]] std::vector<std::size_t> next_rivals(const WideGap& gap, double lower, std::size_t most) const;

  /// A run of budgets with one pick.
  struct Answer {
    std::size_t pick = 0;
    double rival_lower = std::numeric_limits<double>::infinity();  ///< least over the run; of settings but the pick
    double log_gap = 0;                                            ///< most over the run
  };
  /// By falling error; budgets within which nothing has an upper bound have none. With a regret rule: the last alone.
  [[nodiscard]] std::vector<Answer> answers() const;

  /// The setting whose regret is surely the least, as far as is known.
  struct LeastRegret {
    std::size_t pick = 0;
    double low = 0;                                         ///< no setting's regret is less
    double high = std::numeric_limits<double>::infinity();  ///< the pick's is no more
  };
  /// O(n). Needs a regret rule.
  [[nodiscard]] LeastRegret least_regret() const;

  /// Feasible candidates by rising error, then index.
  [[nodiscard]] std::span<const std::size_t> by_error() const { return candidates_; }

 private:
  class Walk;

  /// Bounds on the log time of the fastest.
  struct Fastest {
    double lower = std::numeric_limits<double>::infinity();
    double upper = std::numeric_limits<double>::infinity();
  };
  [[nodiscard]] Fastest fastest() const;
  [[nodiscard]] double regret_low(std::size_t place, const Fastest& fastest) const;
  [[nodiscard]] double regret_high(std::size_t place, const Fastest& fastest) const;

  std::optional<RegretRule> regret_;
  std::vector<std::size_t> candidates_;
  std::vector<std::size_t> place_;  // in the arrays below, one a candidate
  std::vector<double> error_;
  std::vector<double> lower_;
  std::vector<double> upper_;
  std::vector<char> ends_budget_;  // the next setting has a larger error
};

}  // namespace reliefbench
