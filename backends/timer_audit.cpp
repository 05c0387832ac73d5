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
constexpr double kDoublingTolerance = 0.10;

constexpr int kFrameSide_px = 256;
constexpr double kFrame_ns = 10e6;  ///< long against the fixed cost of a frame, which does not double
constexpr double kBatch_ns = 20e6;
constexpr int kFirstSteps = 256;
constexpr int kMaxSteps = 1 << 14;  ///< at work N; llvmpipe ends every loop after 65535 rounds
constexpr int kMaxFrames = 4096;
constexpr int kRounds = 7;
constexpr int kAttempts = 12;  ///< a busy machine spoils every second one or so
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

template <typename Value>
double median_of(const std::vector<Round>& rounds, Value value) {
  std::vector<double> values;
  values.reserve(rounds.size());
  for (const Round& round : rounds) values.push_back(value(round));
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

bool agrees(const TimerAudit& audit) { return std::abs(audit.wall_ratio - 1) <= kWallTolerance; }
bool doubles(const TimerAudit& audit) { return std::abs(audit.doubling / 2 - 1) <= kDoublingTolerance; }

TimerAudit judge(Timer timer, const std::vector<Round>& rounds) {
  const auto read = [timer](const BatchTime& batch) { return reading_ns(batch, timer); };
  TimerAudit audit{.timer = timer, .reason = {}};
  audit.wall_ratio = median_of(rounds, [&](const Round& r) { return ratio(read(r.twice), r.twice.wall_ns); });
  audit.doubling = median_of(rounds, [&](const Round& r) { return ratio(read(r.twice), read(r.single)); });
  audit.valid = agrees(audit) && doubles(audit);
  if (audit.valid) return audit;

  const double said_ms = median_of(rounds, [&](const Round& r) { return read(r.twice); }) * 1e-6;
  const double wall_ms = median_of(rounds, [](const Round& r) { return r.twice.wall_ns; }) * 1e-6;
  if (!agrees(audit)) {
    audit.reason = fmt::format("says {:.3g} ms where the fenced wall clock says {:.3g} ms", said_ms, wall_ms);
  } else {
    audit.reason = fmt::format("twice the work takes {:.3g} times as long, {:.3g} ms", audit.doubling, said_ms);
  }
  return audit;
}

std::vector<TimerAudit> attempt(const Load& load, const std::array<const Pipeline*, 2>& single_and_twice, int frames,
                                const std::vector<Timer>& timers) {
  std::vector<std::vector<Round>> rounds(timers.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < timers.size(); ++i) {
      const BatchTime single = load.time(*single_and_twice[0], frames, timers[i]);
      const BatchTime twice = load.time(*single_and_twice[1], frames, timers[i]);
      rounds[i].push_back({.single = single, .twice = twice});
    }
  }
  std::vector<TimerAudit> audits;
  for (std::size_t i = 0; i < timers.size(); ++i) audits.push_back(judge(timers[i], rounds[i]));
  return audits;
}

}  // namespace

std::vector<TimerAudit> audit_timers(Backend& backend, Dialect dialect, bool by_compute) {
  const Load load(backend, dialect, by_compute);
  Work work = calibrate(load);
  auto single = load.pipeline(work.steps);
  auto twice = load.pipeline(2 * work.steps);

  std::vector<TimerAudit> audits;
  // A timer that agrees with the wall clock but does not double was disturbed, not lying: it is measured again, and
  // where it is the wall clock itself (which always agrees), so are all that were judged by it.
  const auto was_disturbed = [](const TimerAudit& audit) { return agrees(audit) && !doubles(audit); };
  const auto is_wall = [](const TimerAudit& audit) { return audit.timer == Timer::fenced_wall; };
  for (int i = 0; i < kAttempts && (i == 0 || std::ranges::any_of(audits, was_disturbed)); ++i) {
    const bool all = i == 0 || std::ranges::any_of(audits, [&](const TimerAudit& audit) {
                       return is_wall(audit) && was_disturbed(audit);
                     });
    if (i > 0 && all && i % kAttemptsOfWork == 0 && work.steps < kMaxSteps) {
      work.steps *= 2;
      single = std::move(twice);
      twice = load.pipeline(2 * work.steps);
    }
    const std::vector<TimerAudit> fresh =
        attempt(load, {single.get(), twice.get()}, work.frames, backend.device().timers);
    audits.resize(fresh.size());
    for (std::size_t timer = 0; timer < fresh.size(); ++timer)
      if (all || was_disturbed(audits[timer])) audits[timer] = fresh[timer];
  }

  const auto wall = std::ranges::find(audits, Timer::fenced_wall, &TimerAudit::timer);
  if (wall == audits.end() || wall->valid) return audits;
  for (TimerAudit& audit : audits) {
    if (!audit.valid) continue;
    audit.valid = false;
    audit.reason = "the fenced wall clock that it is judged by is not valid";
  }
  return audits;
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
