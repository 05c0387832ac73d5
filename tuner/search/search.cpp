#include "tuner/search/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/search/chains.h"
#include "tuner/search/explore.h"
#include "tuner/search/gaps.h"
#include "tuner/search/noise.h"
#include "tuner/search/observations.h"
#include "tuner/search/random.h"
#include "tuner/search/rounds.h"

namespace reliefbench {
namespace {

constexpr int kFirstBlocks = 3;             // of a setting that the surrogate asked for; they also teach the noise
constexpr std::size_t kSettleBlocks = 120;  // drawn, a batch that the surrogate asked for, to tell it from the others
constexpr std::size_t kLastBlocks = 800;    // likewise where no further setting may be timed
constexpr std::size_t kLeastFirst = 10;     // settings timed before the surrogate is asked, or half of them
constexpr double kRefit = 1.25;             // growth of the blocks after which the noise is estimated anew
constexpr double kPathGrowth = 1.1;         // of the samples between two points of the path
constexpr double kAuditShare = 0.03;        // of the settings ruled out by assumption
constexpr std::size_t kLeastAudits = 10;
constexpr int kAuditBlocks = 2;
constexpr std::size_t kFirstRound = 8;  // settings
constexpr double kAuditMargin = 1.5;    // how much more slack than the failure needs
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
        gaps_(space, options.regret),
        known_(space, options.regret),
        rounds_(space, chains_, gaps_, known_, observed_, options.epsilon),
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
  /// Draws a block of each; false where the search has to end, after those that it may still draw.
  bool draw(std::span<const std::size_t> wanted) {
    if (options_.should_stop && options_.should_stop()) return false;
    std::vector<std::size_t> round;
    round.reserve(wanted.size() + 1);
    for (const std::size_t i : wanted) {
      const bool is_new = !observed_[i].is_measured();
      if ((is_new && is_full()) || !can_draw(std::ssize(round) + 1)) continue;
      if (is_new) observed_[i].order = result_.measured++;
      round.push_back(i);
    }
    if (round.empty()) return false;
    const bool is_all = round.size() == wanted.size();
    accompany(round);
    draw_round(times_, round, observed_);
    last_drawn_ = round.back();
    result_.samples += kBlock * std::ssize(round);
    if (static_cast<double>(result_.samples) >= next_refit_)
      refit();
    else
      for (const std::size_t i : round) bound(i);
    report();
    return is_all;
  }

  /// Sees to it that no setting is drawn twice in a row: one alone gets another's block between its frames, and a round
  /// does not start with what the last one ended with.
  void accompany(std::vector<std::size_t>& round) const {
    if (round.size() == 1 && can_draw(2)) {
      const std::optional<std::size_t> other = rounds_.companion_of(round.front());
      if (other) round = {round.front(), *other};
    }
    if (round.size() > 1 && round.front() == last_drawn_) std::rotate(round.begin(), round.begin() + 1, round.end());
  }

  [[nodiscard]] bool can_draw(std::int64_t blocks) const {
    return options_.max_samples == 0 || result_.samples + kBlock * blocks <= options_.max_samples;
  }

  /// Draws kFirstBlocks blocks of each, between those of settings that are worth more of them. Whether the search goes
  /// on.
  bool measure(std::span<const std::size_t> settings) {
    const auto open = options_.max_measured > 0 ? static_cast<std::size_t>(options_.max_measured - result_.measured)
                                                : settings.size();
    const std::span<const std::size_t> allowed = settings.first(std::min(open, settings.size()));
    for (int block = 0; block < kFirstBlocks && !allowed.empty(); ++block) {
      std::vector<std::size_t> round(allowed.begin(), allowed.end());
      rounds_.add_contenders(round);
      if (!draw(round)) return false;
    }
    return allowed.size() == settings.size();
  }

  void bound(std::size_t candidate) {
    set_bounds(candidate);
    for (const std::size_t larger : chains_.larger(candidate)) {
      if (!observed_[larger].is_measured()) assume(larger);
    }
  }

  void set_bounds(std::size_t candidate) {
    const NoiseModel::Bounds bounds = noise_.bound(observed_[candidate]);
    scales_[candidate] = bounds.block_deviation;
    gaps_.set(candidate, bounds.lower, bounds.upper);
    if (bounds.upper < kInfinity) known_.set(candidate, bounds.lower, bounds.upper);
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
    const double unseen = noise_.block_deviation(Observed{});
    for (const std::size_t i : gaps_.by_error()) {
      if (observed_[i].is_measured())
        set_bounds(i);
      else
        scales_[i] = unseen;
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
    if (first.size() >= kLeastFirst / 2) return first;
    const std::size_t missing = std::min(kLeastFirst, by_error.size()) - first.size();
    for (std::size_t i = 0; i < missing; ++i) add(by_error[(2 * i + 1) * by_error.size() / (2 * missing)]);
    return first;
  }

  /// Whether the search goes on.
  bool explore() {
    const std::vector<std::size_t> first = first_settings();
    for (std::size_t begin = 0; begin < first.size(); begin += kFirstRound)
      if (!measure(std::span(first).subspan(begin, std::min(kFirstRound, first.size() - begin)))) return false;
    Explorer explorer(space_, options_.regret);
    for (;;) {
      refit();
      const std::vector<std::size_t> batch = explorer.propose(observed_, scales_);
      if (batch.empty()) break;
      if (!measure(batch)) {
        if (is_full()) settle(kLastBlocks);
        return false;
      }
      if (!settle(kSettleBlocks)) return false;
    }
    std::vector<double> expected(space_.candidates.size());
    for (const std::size_t i : gaps_.by_error()) expected[i] = explorer.mean(i);
    rounds_.expect(std::move(expected));
    return true;
  }

  [[nodiscard]] bool is_full() const { return options_.max_measured > 0 && result_.measured >= options_.max_measured; }

  /// Races the settings that were timed so far for a while, so that the front of these is one at any time. Nothing is
  /// wasted: the final race would draw the same. False where the search has to end.
  bool settle(std::size_t most) {
    for (std::size_t blocks = 0; blocks < most;) {
      std::vector<std::size_t> round;
      rounds_.add_contenders(round);
      if (round.empty()) break;
      if (!draw(round)) return false;
      blocks += round.size();
    }
    return true;
  }

  void race() {
    const double goal = std::log1p(options_.epsilon);
    for (;;) {
      const std::vector<WideGap> wide = gaps_.wider_than(goal, Rounds::kGaps);
      if (wide.empty()) {
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
      if (!draw(rounds_.race(wide))) return;
    }
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
    for (std::size_t i = 0; i < wanted; ++i) std::swap(assumed[i], assumed[i + random_.below(assumed.size() - i)]);
    assumed.resize(wanted);
    std::vector<double> lower;
    lower.reserve(assumed.size());
    for (const std::size_t i : assumed) lower.push_back(gaps_.lower(i));
    bool goes_on = true;
    for (int block = 0; block < kAuditBlocks && goes_on; ++block)
      for (std::size_t begin = 0; begin < wanted && goes_on; begin += kFirstRound)
        goes_on = draw(std::span(assumed).subspan(begin, std::min(kFirstRound, wanted - begin)));
    for (std::size_t audited = 0; audited < wanted; ++audited) {
      const Observed& observed = observed_[assumed[audited]];
      if (!observed.is_measured()) continue;
      ++result_.audits;
      if (observed.clipped >= lower[audited]) continue;
      ++result_.audit_failures;
      is_audited_ = false;
      audited_slack_ = std::max(audited_slack_, slack_ + kAuditMargin * (lower[audited] - observed.clipped));
    }
    if (!goes_on) is_audited_ = false;
    return goes_on;
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
    result_.correlation = noise_.correlation();
    result_.worst_gap = std::expm1(gaps_.widest().log_gap);
    add_path(result_.worst_gap);
    for (const std::size_t i : gaps_.by_error()) {
      CandidateState& state = result_.states[i];
      if (observed_[i].is_measured()) {
        state = {.evidence = Evidence::measured,
                 .samples = static_cast<int>(observed_[i].frames.size()),
                 .time_ns = std::exp(observed_[i].mean),
                 .low_ns = {},
                 .high_ns = {}};
        if (gaps_.upper(i) < kInfinity) {
          state.low_ns = std::exp(gaps_.lower(i));
          state.high_ns = std::exp(gaps_.upper(i));
        }
      } else if (gaps_.lower(i) > -kInfinity) {
        state.evidence = Evidence::assumed;
        state.low_ns = std::exp(gaps_.lower(i));
      }
    }
    if (options_.regret) result_.least_regret = gaps_.least_regret();
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
  Rounds rounds_;
  NoiseModel noise_;
  Random random_;
  double slack_ = 0;          // log time
  double audited_slack_ = 0;  // the least that failed audits allow
  bool is_audited_ = false;
  double next_refit_ = 0;  // samples
  std::int64_t refitted_at_ = -1;
  double next_path_ = 0;
  std::size_t last_drawn_ = std::numeric_limits<std::size_t>::max();
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
