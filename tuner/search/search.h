#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tuner/search/gaps.h"
#include "tuner/search/observations.h"
#include "tuner/search/regret.h"
#include "tuner/search/space.h"

namespace reliefbench {

struct SearchProgress {
  std::int64_t samples = 0;  ///< frames drawn so far
  int measured = 0;          ///< settings timed so far
  double worst_gap = std::numeric_limits<double>::infinity();
  bool is_certified = false;
};

struct SearchOptions {
  double epsilon = 0.02;     ///< certify picks that are at most this much slower than the best, as a ratio - 1
  double confidence = 0.95;  ///< that all answers hold at once, whenever the search ends
  std::uint64_t seed = 1;    ///< of the audits
  /// Asks for the fastest setting of all and for the one of least regret, instead of the whole front.
  std::optional<RegretRule> regret{};
  std::vector<std::size_t> first{};     ///< measured before all else: the simplest setting of each technique
  std::int64_t max_samples = 0;         ///< frames; 0: no limit
  int max_measured = 0;                 ///< settings; the search ends where it would time one more. 0: no limit
  std::function<bool()> should_stop{};  ///< asked before every round; true ends the search with what it has
  std::function<void(const SearchProgress&)> on_progress{};  ///< told after every round
};

/// Where a setting's lower bound comes from.
enum class Evidence {
  none,     ///< not timed, no bound: the answer may miss it
  assumed,  ///< not timed; ruled out as no faster than a smaller setting of its chain, within the slack
  measured  ///< timed
};

/// All times are exp of the expected log of a median of three frames, in ns: what the search estimates.
struct CandidateState {
  Evidence evidence = Evidence::none;
  int samples = 0;                ///< frames drawn
  std::optional<double> time_ns;  ///< estimate, where measured
  std::optional<double> low_ns;   ///< confidence bounds, none of a single block; or the inherited lower one
  std::optional<double> high_ns;
};

/// The answer to every error budget from max_error up to that of the next cheaper answer.
struct BudgetAnswer {
  double max_error = 0;     ///< the pick's error: the tightest budget that it answers
  std::size_t pick = 0;     ///< index of the candidate; least upper bound among those within the budget
  double time_ns = 0;       ///< estimate of the pick
  double high_ns = 0;       ///< upper bound of the pick
  double rival_low_ns = 0;  ///< least lower bound of any other setting within the budgets answered: 0 where one is
                            ///< unknown, infinite where there is no other
  double gap = 0;           ///< max(0, high / rival_low - 1): the pick is at most this much slower than the best
};

/// The search's state when it had drawn so many frames.
struct PathPoint {
  std::int64_t samples = 0;
  int measured = 0;
  double worst_gap = 0;            ///< infinite while some setting has no bound
  double timed_gap = 0;            ///< the same if there were no settings but those timed so far
  std::vector<std::size_t> picks;  ///< by falling error
};

struct SearchResult {
  std::vector<BudgetAnswer> answers;  ///< by falling error, so rising time; empty if nothing feasible was timed
  std::optional<Gaps::LeastRegret> least_regret{};             ///< where it was asked for
  std::vector<CandidateState> states;                          ///< one a candidate; infeasible ones are never timed
  double worst_gap = std::numeric_limits<double>::infinity();  ///< over all error budgets, see BudgetAnswer::gap
  bool is_certified = false;                                   ///< worst_gap <= epsilon and the audits were passed
  bool is_feasible = true;                                     ///< whether any candidate meets the constraints
  std::int64_t samples = 0;
  int measured = 0;
  double correlation = 1;  ///< between a setting's frames of one round, an upper estimate; see NoiseModel
  double slack = 0;        ///< ratio - 1 by which more steps may yet be faster, as estimated
  int audits = 0;          ///< settings ruled out by assumption and timed after all
  int audit_failures = 0;  ///< of these, those that were faster than assumed
  std::vector<PathPoint> path;
};

/// Frames a setting of the space after which comparisons of searches give a certificate up: few and noisy samples may
/// never allow one.
inline constexpr std::int64_t kPatience = 30;

/// The cheapest feasible setting for every error budget at once, with a certificate.
///
/// Errors are exact and only time is noisy, so that the front is the record minima of time along the settings sorted by
/// error: nested best-arm identification. A Gaussian process on log time orders what is timed first (improvement.h);
/// then a race draws rounds of the settings that decide the widest gaps over the error budgets e, until all are at most
/// epsilon: G(e) = U(pick) / L(rival) - 1, of the least upper bound and the least lower bound of the others. What
/// the surrogate believes never rules a setting out: bounds do (noise.h), and where a setting was not timed, the bound
/// of a smaller one of its chain (chains.h), which is recorded as assumed.
///
/// Frames are drawn in rounds, a block of each of several settings, whose frames are interleaved.
///
/// A pure function of space, options and the values that `times` returns: replaying them gives the same calls again.
/// throws: Error(bad_input): a bad space or option; a time that is not a positive number
[[nodiscard]] SearchResult search(const SearchSpace& space, TimeSource& times, const SearchOptions& options);

/// The answer for an error budget; null if no answer is as accurate.
[[nodiscard]] const BudgetAnswer* answer_for(std::span<const BudgetAnswer> answers, double error_budget);

}  // namespace reliefbench
