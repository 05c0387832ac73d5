#include "tuner/tune/tuner.h"

#include <limits>
#include <numeric>
#include <tuple>

#include "tuner/results/statistics.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

class Tuner {
 public:
  Tuner(TuneSource& source, const TuneOptions& options, TuneClock& clock)
      : source_(source), options_(options), clock_(clock), result_(source.blank()), all_scenes_(result_.scenes.size()) {
    result_.question = options.question;
    std::iota(all_scenes_.begin(), all_scenes_.end(), std::size_t{0});
  }

  TuneResult run() {
    const bool has_scenes = all_scenes_.size() > 1;
    race(has_scenes ? 0.5 : 1.0);
    if (has_scenes && result_.pick) answer_scenes();
    if (!result_.search.is_feasible) std::tie(result_.nearest, result_.miss) = source_.nearest();
    result_.is_stopped = clock_.is_stopped();
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
        result, *times, [&] { return clock_.is_over(until_s); }, on_progress, source_.asked_error(),
        [&](std::size_t candidate) { return source_.memory_bytes(scenes.front(), candidate); });
  }

  void race(double share) {
    const double end_s = until_s(share);
    for (;;) {
      result_.space = source_.space(all_scenes_);
      if (result_.space.candidates.empty()) return;
      Progress progress(options_.quiet);
      try {
        search_scenes(result_, all_scenes_, end_s, [&](const SearchProgress& now) {
          show(progress, now, options_.question, clock_.elapsed_s() / end_s);
        });
        progress.finish();
        return;
      } catch (const CaseFailed& failed) {  // what was timed is kept, so the search comes back to here at once
        source_.take_failure(failed, true);
        --result_.counts.scored;
        ++result_.counts.failed;
      }
    }
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

TuneResult tune(TuneSource& source, const TuneOptions& options, TuneClock& clock) {
  return Tuner(source, options, clock).run();
}

}  // namespace reliefbench
