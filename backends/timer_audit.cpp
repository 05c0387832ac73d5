#include "backends/timer_audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "backends/shader_compiler.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr double kWallTolerance = 0.05;
/// What a busy machine may add to the wall clock's time. Liars that were met are off by factors.
constexpr double kNearTolerance = 0.20;
constexpr double kDoublingTolerance = 0.10;

constexpr int kFrameSide_px = 256;
constexpr double kFrame_ns = 10e6;  ///< long against the fixed cost of a frame, which does not double
constexpr double kBatch_ns = 20e6;
constexpr int kFirstSteps = 256;
constexpr int kMaxSteps = 1 << 14;  ///< at work N; llvmpipe ends every loop after 65535 rounds
constexpr int kMaxFrames = 4096;
constexpr std::size_t kRounds = 7;
constexpr int kAttempts = 12;           ///< a busy machine spoils every second one or so
constexpr int kAttemptsAtNearness = 5;  ///< however the first of them come out: none is to be picked
/// Where the wall clock does not double so often, the work is too short: below some milliseconds a system may leave a
/// rasteriser's threads on one core, and above spread them.
constexpr int kAttemptsOfWork = 2;

/// Fills frames with `steps` of known work.
class Load {
 public:
  Load(Backend& backend, Dialect dialect, bool by_compute)
      : backend_(backend), vertex_(compile_vertex(dialect)), load_(compile_load(dialect, by_compute)) {
    target_.by_compute = by_compute;
  }

  [[nodiscard]] std::unique_ptr<Pipeline> pipeline(int steps) const {
    auto pipeline = backend_.compile({.label = "load",
                                      .vertex = vertex_,
                                      .fragment = load_,
                                      .constants = {{.id = 0, .value = steps}},
                                      .target = target_});
    static_cast<void>(time(*pipeline, 1, Timer::fenced_wall));  // drivers compile as late as the first draw
    return pipeline;
  }

  [[nodiscard]] BatchTime time(const Pipeline& pipeline, int frames, Timer timer) const {
    Draw draw{.pipeline = &pipeline};
    draw.frame.sizes = {kFrameSide_px, kFrameSide_px, 2, 2};
    return backend_.render(draw, frames, timer);
  }

 private:
  Backend& backend_;
  Spirv vertex_;
  Spirv load_;
  Target target_ = Target::color;
};

/// Known work N: batches of so many frames of so many steps.
struct Work {
  int steps = kFirstSteps;
  int frames = 1;
};

Work calibrate(const Load& load) {
  Work work;
  auto pipeline = load.pipeline(work.steps);
  while (load.time(*pipeline, 1, Timer::fenced_wall).wall_ns < kFrame_ns && work.steps < kMaxSteps) {
    work.steps *= 2;
    pipeline = load.pipeline(work.steps);
  }
  while (load.time(*pipeline, work.frames, Timer::fenced_wall).wall_ns < kBatch_ns && work.frames < kMaxFrames) {
    work.frames *= 2;
  }
  return work;
}

/// One round: work N and 2N, one after the other, so that a slow spell of the machine hits both.
struct Round {
  BatchTime single;
  BatchTime twice;
};

/// What a timer itself says; 0 where it says nothing.
double reading_ns(const BatchTime& batch, Timer timer) {
  const double ns = timer == Timer::fenced_wall ? batch.wall_ns : batch.device_ns.value_or(0);
  return std::isfinite(ns) ? ns : 0;
}

double ratio(double numerator, double denominator) { return denominator > 0 ? numerator / denominator : 0; }

/// The round whose value is the median.
template <typename Value>
Round median_round(std::vector<Round>& rounds, Value value) {
  const auto middle = rounds.begin() + static_cast<std::ptrdiff_t>(rounds.size() / 2);
  std::ranges::nth_element(rounds, middle, {}, value);
  return *middle;
}

/// Those that the machine disturbed least: what else it did, they took longest for. As many as one attempt has.
std::vector<Round> quietest(std::vector<Round> rounds) {
  std::ranges::stable_sort(rounds, {}, [](const Round& round) { return round.single.wall_ns + round.twice.wall_ns; });
  if (rounds.size() > kRounds) rounds.resize(kRounds);
  return rounds;
}

double wall_error(const TimerAudit& audit) { return std::abs(audit.wall_ratio - 1); }
bool agrees(const TimerAudit& audit) { return wall_error(audit) <= kWallTolerance; }
bool nearly_agrees(const TimerAudit& audit) { return !agrees(audit) && wall_error(audit) <= kNearTolerance; }
bool doubles(const TimerAudit& audit) { return std::abs(audit.doubling / 2 - 1) <= kDoublingTolerance; }

/// By the medians of the rounds.
TimerAudit judge(Timer timer, std::vector<Round> rounds) {
  const auto read = [timer](const BatchTime& batch) { return reading_ns(batch, timer); };
  const auto of_wall = [&](const Round& round) { return ratio(read(round.twice), round.twice.wall_ns); };
  const auto of_single = [&](const Round& round) { return ratio(read(round.twice), read(round.single)); };
  const Round against_wall = median_round(rounds, of_wall);
  const Round against_single = median_round(rounds, of_single);
  TimerAudit audit{
      .timer = timer, .wall_ratio = of_wall(against_wall), .doubling = of_single(against_single), .reason = {}};
  audit.valid = agrees(audit) && doubles(audit);
  if (audit.valid) return audit;
  if (!agrees(audit)) {
    audit.reason = fmt::format("says {:.3g} ms where the fenced wall clock says {:.3g} ms",
                               read(against_wall.twice) * 1e-6, against_wall.twice.wall_ns * 1e-6);
  } else {
    audit.reason = fmt::format("twice the work takes {:.3g} times as long, {:.3g} ms", audit.doubling,
                               read(against_single.twice) * 1e-6);
  }
  return audit;
}

/// A timer under audit.
struct Audited {
  Timer timer;
  std::vector<Round> rounds{};  ///< of all attempts at this work
  bool was_near = false;        ///< to the wall clock, in some attempt, without agreeing with it
  TimerAudit verdict{};
};

/// Adds an attempt's rounds to those of each timer, and judges it anew.
void add_attempt(const Load& load, const std::array<const Pipeline*, 2>& single_and_twice, int frames,
                 const std::vector<Audited*>& timers) {
  for (std::size_t round = 0; round < kRounds; ++round) {
    for (Audited* one : timers) {
      const BatchTime single = load.time(*single_and_twice[0], frames, one->timer);
      const BatchTime twice = load.time(*single_and_twice[1], frames, one->timer);
      one->rounds.push_back({.single = single, .twice = twice});
    }
  }
  for (Audited* one : timers) {
    const std::vector<Round> last(one->rounds.end() - std::ptrdiff_t{kRounds}, one->rounds.end());
    one->verdict = judge(one->timer, one->was_near ? quietest(one->rounds) : last);
    one->was_near |= nearly_agrees(one->verdict);
  }
}

bool is_part_clock(Timer timer) { return timer == Timer::gl_timestamp || timer == Timer::vk_timestamp; }

std::vector<TimerAudit> audit_of(const std::vector<Timer>& audited, Backend& backend, Dialect dialect,
                                 bool by_compute) {
  const Load load(backend, dialect, by_compute);
  Work work = calibrate(load);
  auto single = load.pipeline(work.steps);
  auto twice = load.pipeline(2 * work.steps);

  std::vector<Audited> timers;
  timers.reserve(audited.size());
  for (const Timer timer : audited) timers.push_back({.timer = timer});
  // A timer that agrees with the wall clock but does not double was disturbed, not lying, and one that nearly agrees
  // may have been: it is measured again, and where it is the wall clock itself (which always agrees), so are all that
  // were judged by it.
  for (int attempts = 0; attempts < kAttempts; ++attempts) {
    const auto is_wanted = [&](const Audited& one) {
      if (attempts == 0 || (one.was_near && attempts < kAttemptsAtNearness)) return true;
      return agrees(one.verdict) && !doubles(one.verdict);
    };
    const bool all = std::ranges::any_of(
        timers, [&](const Audited& one) { return one.timer == Timer::fenced_wall && is_wanted(one); });
    if (attempts > 0 && all && attempts % kAttemptsOfWork == 0 && work.steps < kMaxSteps) {
      work.steps *= 2;
      single = std::move(twice);
      twice = load.pipeline(2 * work.steps);
      for (Audited& one : timers) one.rounds.clear();
    }
    std::vector<Audited*> wanted;
    for (Audited& one : timers)
      if (all || is_wanted(one)) wanted.push_back(&one);
    if (wanted.empty()) break;
    add_attempt(load, {single.get(), twice.get()}, work.frames, wanted);
  }
  std::vector<TimerAudit> audits;
  audits.reserve(timers.size());
  for (const Audited& one : timers) audits.push_back(one.verdict);

  const auto wall = std::ranges::find(audits, Timer::fenced_wall, &TimerAudit::timer);
  if (wall == audits.end() || wall->valid) return audits;
  for (TimerAudit& audit : audits) {
    if (!audit.valid) continue;
    audit.valid = false;
    audit.reason = "the fenced wall clock that it is judged by is not valid";
  }
  return audits;
}

}  // namespace

std::vector<TimerAudit> audit_timers(Backend& backend, Dialect dialect, bool by_compute) {
  return audit_of(backend.device().timers, backend, dialect, by_compute);
}

const TimerAudit* find_part_clock(const std::vector<TimerAudit>& audit) {
  const auto found = std::ranges::find_if(audit, is_part_clock, &TimerAudit::timer);
  return found == audit.end() ? nullptr : &*found;
}

std::optional<TimerAudit> audit_part_clock(Backend& backend, Dialect dialect) {
  const std::vector<Timer>& timers = backend.device().timers;
  const auto clock = std::ranges::find_if(timers, is_part_clock);
  if (clock == timers.end()) return std::nullopt;
  try {
    return audit_of({Timer::fenced_wall, *clock}, backend, dialect, true).back();
  } catch (const Error& error) {
    return TimerAudit{.timer = *clock, .reason = error.what()};
  }
}

std::vector<TimerAudit> with_compute(std::vector<TimerAudit> audit, const std::vector<TimerAudit>& by_compute) {
  for (TimerAudit& of_draws : audit) {
    const auto found = std::ranges::find(by_compute, of_draws.timer, &TimerAudit::timer);
    if (!of_draws.valid || found == by_compute.end() || found->valid) continue;
    of_draws = *found;
    of_draws.reason = "compute: " + found->reason;
  }
  return audit;
}

Timer choose_timer(const std::vector<TimerAudit>& audit) {
  const auto device =
      std::ranges::find_if(audit, [](const TimerAudit& a) { return a.valid && a.timer != Timer::fenced_wall; });
  if (device != audit.end()) return device->timer;
  const auto wall = std::ranges::find(audit, Timer::fenced_wall, &TimerAudit::timer);
  if (wall == audit.end()) fail_environment("no valid timer: the fenced wall clock was not audited");
  if (!wall->valid) fail_environment("no valid timer: fenced_wall: {}", wall->reason);
  return Timer::fenced_wall;
}

}  // namespace reliefbench
