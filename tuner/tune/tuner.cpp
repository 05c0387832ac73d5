#include "tuner/tune/tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/statistics.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

class Tuner {
 public:
  Tuner(TuneSource& source, const TuneOptions& options, TuneClock& clock, std::optional<MatchedFleet> fleet)
      : source_(source),
        options_(options),
        clock_(clock),
        fleet_(std::move(fleet)),
        result_(source.blank()),
        all_scenes_(result_.scenes.size()) {
    result_.question = options.question;
    std::iota(all_scenes_.begin(), all_scenes_.end(), std::size_t{0});
  }

  TuneResult run() {
    const bool has_scenes = all_scenes_.size() > 1;
    race(has_scenes ? 0.5 : 1.0);
    if (has_scenes && result_.pick) answer_scenes();
    if (fleet_ && result_.pick) answer_fleet();
    result_.is_stopped = clock_.is_stopped();
    if (!result_.pick) say_why();
    return std::move(result_);
  }

 private:
  /// The moment when that share of the time that is left is over.
  [[nodiscard]] double until_s(double share) const {
    return clock_.elapsed_s() + share * (clock_.limit_s() - clock_.elapsed_s());
  }

  void search_scenes(TuneResult& result, std::span<const std::size_t> scenes, double until_s,
                     const std::function<void(const SearchProgress&)>& on_progress) {
    const std::unique_ptr<TimeSource> times = source_.times(scenes);
    search_into(
        result, *times, [&] { return clock_.is_over(until_s); }, on_progress, source_.asked_error(), source_.patience(),
        [&](std::size_t candidate) { return source_.memory_bytes(scenes.front(), candidate); },
        fleet_ ? &fleet_->losses : nullptr);
  }

  void race(double share) {
    const double end_s = until_s(share);
    for (;;) {
      result_.space = source_.space(all_scenes_);
      if (result_.space.candidates.empty()) return;
      Progress& progress = source_.progress();
      try {
        search_scenes(result_, all_scenes_, end_s, [&](const SearchProgress& now) {
          show(progress, now, options_.question, clock_.elapsed_s() / end_s);
        });
        progress.finish();
        return;
      } catch (const CaseFailed& failed) {  // what was timed is kept, so the search comes back to here at once
        progress.finish();
        source_.take_failure(failed, true);
        --result_.counts.scored;
        ++result_.counts.failed;
      }
    }
  }

  /// Why there is no pick, and what comes nearest to one. What was not searched to its end may yet have one.
  void say_why() {
    if (!result_.search.is_feasible) {
      std::tie(result_.nearest, result_.miss) = source_.nearest();
    } else if (result_.space.candidates.empty()) {
      if (result_.counts.scored > 0) result_.miss = fmt::format("no setting has a value of {}", result_.error_metric);
    } else if (!result_.is_stopped) {
      std::tie(result_.nearest, result_.miss) = nearest_answer(result_, source_.asked_error());
    }
  }

  /// By the rule of `choose`, of what was timed here and the fleet's runs.
  void answer_fleet() {
    std::vector<FleetRun> runs;
    runs.push_back(source_.timed_run());
    std::ranges::move(fleet_->runs, std::back_inserter(runs));
    try {
      Fleet fleet = choose_for_fleet(runs, fleet_->options);
      const double high = most_regret(setting_id(fleet.settings.front().settings));
      result_.fleet = std::make_unique<FleetAnswer>(FleetAnswer{.runs = std::move(runs),
                                                                .options = fleet_->options,
                                                                .fleet = std::move(fleet),
                                                                .low = result_.search.least_regret->low,
                                                                .high = high});
    } catch (const Error& error) {
      if (error.code() != Exit::answer_is_no) throw;
      result_.fleet_refusal = error.what();
    }
  }

  /// Of a setting, by the search's bounds.
  [[nodiscard]] double most_regret(const std::string& setting) const {
    const double unbounded = std::numeric_limits<double>::infinity();
    double fastest_ns = unbounded;
    double high_ns = unbounded;
    for (std::size_t i = 0; i < result_.space.candidates.size(); ++i) {
      if (!result_.space.candidates[i].is_feasible) continue;
      const CandidateState& state = result_.search.states[i];
      fastest_ns = std::min(fastest_ns, state.low_ns.value_or(0));
      if (result_.space.candidates[i].id == setting) high_ns = state.high_ns.value_or(unbounded);
    }
    return fleet_->losses.rule.regret(fleet_->losses.loss(setting), high_ns / fastest_ns);
  }

  void answer_scenes() {
    for (const std::size_t scene : all_scenes_) {
      const double end_s = until_s(1 / static_cast<double>(all_scenes_.size() - scene));
      TuneResult alone{.question = options_.question};
      alone.space = source_.space({&scene, 1});
      SceneAnswer answer{.scene = result_.scenes[scene]};
      try {
        search_scenes(alone, {&scene, 1}, end_s, [](const SearchProgress&) {});
        answer.own = alone.pick;
      } catch (const CaseFailed& failed) {  // drawn in the other scenes: this one's answer is left out
        source_.take_failure(failed, false);
      }
      if (answer.own) set_gain(answer, scene);
      result_.scene_answers.push_back(std::move(answer));
    }
  }

  /// Holds a scene's own pick to the common one, on the samples that the scene has of both.
  void set_gain(SceneAnswer& answer, std::size_t scene) {
    const std::vector<double> common_times = source_.times_ns(scene, result_.pick->setting);
    const std::vector<double> own_times = source_.times_ns(scene, answer.own->setting);
    if (common_times.empty() || own_times.empty()) return;
    const Summary common = summarise(common_times);
    const Summary own = summarise(own_times);
    answer.common_ns = common.median;
    if (answer.own->setting == result_.pick->setting || own.median >= common.median) {
      answer.own = *result_.pick;
      answer.own_ns = common.median;
      return;
    }
    answer.own_ns = own.median;
    answer.gain = 1 - own.median / common.median;
    answer.gain_low = 1 - own.ci_high / common.ci_low;
    answer.gain_high = 1 - own.ci_low / common.ci_high;
  }

  TuneSource& source_;
  const TuneOptions& options_;
  TuneClock& clock_;
  std::optional<MatchedFleet> fleet_;
  TuneResult result_;
  std::vector<std::size_t> all_scenes_;
};

}  // namespace

double TuneClock::elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

double TuneClock::limit_s() const { return options_.time_limit_s.value_or(std::numeric_limits<double>::infinity()); }

bool TuneClock::is_over(double until_s) {
  const bool over = options_.is_interrupted() || elapsed_s() > until_s;
  is_stopped_ |= over;
  return over;
}

std::optional<MatchedFleet> match_fleet(const TuneSource& source, const TuneOptions& options) {
  if (!options.fleet) return std::nullopt;
  const TunePlace place = source.place();
  MatchedFleet matched{.runs = runs_in_scene(options.fleet->runs, place),
                       .options = {.budgets = options.question.max_error,
                                   .regret = options.fleet->regret,
                                   .confidence = options.question.confidence},
                       .losses = {}};
  matched.losses = losses_of_others(matched.runs, place, matched.options);
  return matched;
}

TuneResult tune(TuneSource& source, const TuneOptions& options, TuneClock& clock, std::optional<MatchedFleet> fleet) {
  return Tuner(source, options, clock, std::move(fleet)).run();
}

}  // namespace reliefbench
