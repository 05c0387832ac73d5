#include "tuner/search/search.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "tuner/search/chains.h"
#include "tuner/search/explore.h"
#include "tuner/search/gaps.h"
#include "tuner/search/noise.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"

namespace reliefbench {
namespace {

constexpr int kFirstBlocks = 3;            // of a setting that the surrogate asked for; they also teach the noise
constexpr std::size_t kSettleBlocks = 20;  // drawn, a setting that the surrogate asked for, to tell it from the others
constexpr std::size_t kLeastFirst = 10;    // settings timed before the surrogate is asked
constexpr double kRefit = 1.25;            // growth of the blocks after which the noise is estimated anew
constexpr double kPathGrowth = 1.1;        // of the samples between two points of the path
constexpr double kAuditShare = 0.03;       // of the settings ruled out by assumption
constexpr std::size_t kLeastAudits = 10;
constexpr double kAuditMargin = 1.5;  // how much more slack than the failure needs
constexpr double kPickIsSharp = 0.6;  // a pick whose bounds are so much narrower than its rival's is not drawn again
constexpr double kBlockNoise = 0.67;  // standard deviation of a block's median in that of a frame, if normal
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void check(const SearchSpace& space, const SearchOptions& options) {
  space.check();
  if (!(options.epsilon > 0)) fail_input("epsilon must be positive, not {}", options.epsilon);
  if (!(options.confidence > 0 && options.confidence < 1))
    fail_input("the confidence must be in (0, 1), not {}", options.confidence);
  for (const std::size_t i : options.first) {
    if (i >= space.candidates.size()) fail_input("there is no setting {} to time first", i);
  }
}

class Search {
 public:
  Search(const SearchSpace& space, TimeSource& times, const SearchOptions& options)
      : space_(space),
        times_(times),
        options_(options),
        observed_(space.candidates.size()),
        scales_(space.candidates.size()),
        chains_(space),
        gaps_(space),
        known_(space),
        noise_(gaps_.by_error().size(), options.confidence),
        random_(options.seed) {
    for (const std::size_t i : gaps_.by_error()) known_.set(i, kInfinity, kInfinity);
  }

  SearchResult run() {
    result_.states.resize(space_.candidates.size());
    result_.is_feasible = !gaps_.by_error().empty();
    if (result_.is_feasible) {
      slack_ = kPriorSlack;
      if (explore()) race();
      if (refitted_at_ != result_.samples) refit();
      finish();
    }
    return std::move(result_);
  }

 private:
  /// Draws one block; false where the search has to end instead.
  bool draw(std::size_t candidate) {
    if (options_.should_stop && options_.should_stop()) return false;
    if (options_.max_samples > 0 && result_.samples + kBlock > options_.max_samples) return false;
    Observed& observed = observed_[candidate];
    if (!observed.is_measured()) {
      if (is_full()) return false;
      observed.order = result_.measured++;
    }
    draw_block(times_, candidate, observed);
    result_.samples += kBlock;
    if (static_cast<double>(result_.samples) >= next_refit_)
      refit();
    else
      bound(candidate);
    report();
    return true;
  }

  void bound(std::size_t candidate) {
    set_bounds(candidate);
    for (const std::size_t larger : chains_.larger(candidate)) {
      if (!observed_[larger].is_measured()) assume(larger);
    }
  }

  void set_bounds(std::size_t candidate) {
    const NoiseModel::Bounds bounds = noise_.bound(observed_[candidate]);
    scales_[candidate] = kBlockNoise * noise_.scale(observed_[candidate]);
    gaps_.set(candidate, bounds.lower, bounds.upper);
    known_.set(candidate, bounds.lower, bounds.upper);
  }

  void assume(std::size_t candidate) {
    double lower = -kInfinity;
    for (const std::size_t smaller : chains_.smaller(candidate)) {
      if (observed_[smaller].is_measured()) lower = std::max(lower, gaps_.lower(smaller) - slack_);
    }
    gaps_.set(candidate, lower, kInfinity);
  }

  /// Estimates noise and slack from all that was drawn, and all bounds with them.
  void refit() {
    next_refit_ = std::max(60.0, kRefit * static_cast<double>(result_.samples));
    refitted_at_ = result_.samples;
    noise_.fit(observed_);
    for (const std::size_t i : gaps_.by_error()) {
      if (observed_[i].is_measured())
        set_bounds(i);
      else
        scales_[i] = kBlockNoise * noise_.scale(observed_[i]);
    }
    slack_ = std::max(estimate_slack(chains_, observed_, scales_), audited_slack_);
    for (const std::size_t i : gaps_.by_error()) {
      if (!observed_[i].is_measured()) assume(i);
    }
  }

  /// The settings timed before the surrogate is asked: those the caller wants, the most accurate and, if these are few,
  /// some evenly spread over the errors.
  [[nodiscard]] std::vector<std::size_t> first_settings() const {
    const std::span<const std::size_t> by_error = gaps_.by_error();
    std::vector<std::size_t> first;
    const auto add = [&](std::size_t i) {
      if (space_.candidates[i].is_feasible && std::ranges::find(first, i) == first.end()) first.push_back(i);
    };
    for (const std::size_t i : options_.first) add(i);
    add(by_error.front());
    const std::size_t wanted = std::min(kLeastFirst, by_error.size());
    const std::size_t missing = wanted > first.size() ? wanted - first.size() : 0;
    for (std::size_t i = 0; i < missing; ++i) add(by_error[(2 * i + 1) * by_error.size() / (2 * missing)]);
    return first;
  }

  /// Whether the search goes on.
  bool explore() {
    const auto measure = [&](std::size_t candidate) {
      for (int block = 0; block < kFirstBlocks; ++block) {
        if (!draw(candidate)) return false;
      }
      return true;
    };
    for (const std::size_t i : first_settings()) {
      if (!measure(i)) return false;
    }
    Explorer explorer(space_);
    for (;;) {
      refit();
      const std::vector<std::size_t> batch = explorer.propose(observed_, scales_);
      if (batch.empty()) break;
      for (const std::size_t i : batch) {
        if (measure(i)) continue;
        if (is_full()) settle();
        return false;
      }
      if (!settle()) return false;
    }
    for (std::size_t i = 0; i < space_.candidates.size(); ++i) expected_.push_back(explorer.mean(i));
    return true;
  }

  [[nodiscard]] bool is_full() const { return options_.max_measured > 0 && result_.measured >= options_.max_measured; }

  /// Races the settings that were timed so far for a while, so that the front of these is one at any time. Nothing is
  /// wasted: the final race would draw the same. False where the search has to end.
  bool settle() {
    for (std::size_t blocks = 0; blocks < kSettleBlocks * Explorer::kBatch; blocks += 2) {
      const WidestGap widest = known_.widest();
      if (widest.log_gap <= std::log1p(options_.epsilon)) break;
      if (!draw(widest.rival)) return false;
      if (widest.pick != widest.rival && !draw(widest.pick)) return false;
    }
    return true;
  }

  void race() {
    const double goal = std::log1p(options_.epsilon);
    for (;;) {
      const WidestGap widest = gaps_.widest();
      if (widest.log_gap <= goal) {
        // Certified is what holds with everything known: the noise as of now, and all audits passed.
        if (refitted_at_ != result_.samples) {
          refit();
        } else if (!is_audited_) {
          if (!audit()) return;
        } else {
          result_.is_certified = true;
          return;
        }
        continue;
      }
      const std::size_t rival = sharpest_rival(widest);
      if (!draw(rival)) return;
      const bool has_pick = widest.log_gap < kInfinity && widest.pick != rival;
      if (has_pick && width(widest.pick) > kPickIsSharp * width(rival) && !draw(widest.pick)) return;
    }
  }

  [[nodiscard]] double width(std::size_t i) const { return gaps_.upper(i) - gaps_.lower(i); }

  /// The setting to draw for the rival's side of a gap. A rival that was not timed shares its bound with others: the
  /// smallest of its chain within the budget is drawn, as its bound then holds for all of them.
  [[nodiscard]] std::size_t sharpest_rival(const WidestGap& widest) const {
    if (observed_[widest.rival].is_measured()) return widest.rival;
    std::size_t rival = widest.rival;
    if (gaps_.lower(rival) == -kInfinity) {
      // Nothing is known of it: of all such, the one that the surrogate believes to be fastest.
      for (const std::size_t i : gaps_.by_error()) {
        if (gaps_.lower(i) == -kInfinity && expected_[i] < expected_[rival]) rival = i;
      }
    }
    const double bound = gaps_.lower(rival);
    for (const std::size_t smaller : chains_.smaller(rival)) {
      const bool is_within = space_.candidates[smaller].error <= widest.budget || bound == -kInfinity;
      if (observed_[smaller].is_measured() || !is_within || gaps_.lower(smaller) > bound) continue;
      if (chains_.smaller(smaller).size() < chains_.smaller(rival).size()) rival = smaller;
    }
    return rival;
  }

  /// Times some settings that were ruled out by assumption; until none of a round fails. False where the search has to
  /// end instead.
  bool audit() {
    std::vector<std::size_t> assumed;
    for (const std::size_t i : gaps_.by_error()) {
      if (!observed_[i].is_measured()) assumed.push_back(i);
    }
    const auto share = static_cast<std::size_t>(kAuditShare * static_cast<double>(assumed.size()));
    const std::size_t wanted = std::min(std::max(kLeastAudits, share), assumed.size());
    is_audited_ = true;
    for (std::size_t drawn = 0; drawn < wanted; ++drawn) {
      std::swap(assumed[drawn], assumed[drawn + random_.below(assumed.size() - drawn)]);
      const std::size_t i = assumed[drawn];
      const double lower = gaps_.lower(i);
      if (!draw(i)) return is_audited_ = false;
      ++result_.audits;
      if (observed_[i].clipped >= lower) continue;
      ++result_.audit_failures;
      is_audited_ = false;
      audited_slack_ = std::max(audited_slack_, slack_ + kAuditMargin * (lower - observed_[i].clipped));
    }
    return true;
  }

  void report() {
    if (!options_.on_progress && static_cast<double>(result_.samples) < next_path_) return;
    const double gap = std::expm1(gaps_.widest().log_gap);
    if (options_.on_progress)
      options_.on_progress(
          {.samples = result_.samples, .measured = result_.measured, .worst_gap = gap, .is_certified = false});
    if (static_cast<double>(result_.samples) < next_path_) return;
    next_path_ = kPathGrowth * static_cast<double>(result_.samples) + 10 * kBlock;
    add_path(gap);
  }

  void add_path(double gap) {
    PathPoint point{.samples = result_.samples,
                    .measured = result_.measured,
                    .worst_gap = gap,
                    .timed_gap = std::expm1(known_.widest().log_gap),
                    .picks = {}};
    for (const Gaps::Answer& answer : gaps_.answers()) point.picks.push_back(answer.pick);
    result_.path.push_back(std::move(point));
  }

  void finish() {
    result_.slack = std::expm1(slack_);
    result_.worst_gap = std::expm1(gaps_.widest().log_gap);
    add_path(result_.worst_gap);
    for (const std::size_t i : gaps_.by_error()) {
      CandidateState& state = result_.states[i];
      if (observed_[i].is_measured()) {
        state = {.evidence = Evidence::measured,
                 .samples = static_cast<int>(observed_[i].frames.size()),
                 .time_ns = std::exp(observed_[i].mean),
                 .low_ns = std::exp(gaps_.lower(i)),
                 .high_ns = std::exp(gaps_.upper(i))};
      } else if (gaps_.lower(i) > -kInfinity) {
        state.evidence = Evidence::assumed;
        state.low_ns = std::exp(gaps_.lower(i));
      }
    }
    for (const Gaps::Answer& answer : gaps_.answers()) {
      const double upper = gaps_.upper(answer.pick);
      result_.answers.push_back({.max_error = space_.candidates[answer.pick].error,
                                 .pick = answer.pick,
                                 .time_ns = std::exp(observed_[answer.pick].mean),
                                 .high_ns = std::exp(upper),
                                 .rival_low_ns = std::exp(answer.rival_lower),
                                 .gap = std::expm1(answer.log_gap)});
    }
    if (options_.on_progress)
      options_.on_progress({.samples = result_.samples,
                            .measured = result_.measured,
                            .worst_gap = result_.worst_gap,
                            .is_certified = result_.is_certified});
  }

  const SearchSpace& space_;
  TimeSource& times_;
  const SearchOptions& options_;
  std::vector<Observed> observed_;
  std::vector<double> scales_;  // standard deviation of a block's log time, one a candidate
  Chains chains_;
  Gaps gaps_;
  Gaps known_;  // the same, with only the settings that were timed
  NoiseModel noise_;
  Random random_;
  std::vector<double> expected_;  // log time, by the surrogate
  double slack_ = 0;              // log time
  double audited_slack_ = 0;      // the least that failed audits allow
  bool is_audited_ = false;
  double next_refit_ = 0;  // samples
  std::int64_t refitted_at_ = -1;
  double next_path_ = 0;
  SearchResult result_;
};

}  // namespace

SearchResult search(const SearchSpace& space, TimeSource& times, const SearchOptions& options) {
  check(space, options);
  return Search(space, times, options).run();
}

const BudgetAnswer* answer_for(std::span<const BudgetAnswer> answers, double error_budget) {
  const auto found = std::ranges::find_if(answers, [&](const BudgetAnswer& a) { return a.max_error <= error_budget; });
  return found == answers.end() ? nullptr : &*found;
}

}  // namespace reliefbench
