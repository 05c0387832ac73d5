#include "tuner/measure/timing.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tuner/measure/harness.h"

namespace reliefbench {
namespace {

/// What `work` returns, under the case's mark. throws: CaseFailed
template <typename Work>
auto drawn(const Timing& timing, const Record& record, const Work& work) {
  std::optional<CaseMark::Hold> hold;
  if (timing.mark != nullptr) hold.emplace(*timing.mark, record.case_id);
  try {
    return work();
  } catch (...) {
    Record failed = record;
    enter_failure(failed, Status::unsupported);
    throw CaseFailed(std::move(failed));
  }
}

int warm_batch(Session& session, std::span<const Draw> draws, const MeasureSpec& measure) {
  double previous_ns = session.draw_ns(draws, 1);
  int frames = batch_frames(measure.batch_ms, previous_ns);
  for (int batch = 0; batch < measure.warmup_batches_max; ++batch) {
    const double frame_ns = session.draw_ns(draws, frames) / frames;
    const bool settled = std::abs(frame_ns - previous_ns) <= 0.05 * frame_ns;
    previous_ns = frame_ns;
    frames = batch_frames(measure.batch_ms, frame_ns);
    if (settled) break;
  }
  return frames;
}

double slowdown_of(const Timing& timing, const Record& record) {
  if (timing.slowdowns == nullptr) return 1;
  const auto found = timing.slowdowns->find(record.technique);
  return found == timing.slowdowns->end() ? 1 : found->second;
}

/// The batches in their order, with one of the control case before them, after them and between, after every `every`.
std::vector<TimedBatch> with_control(std::span<const TimedBatch> batches, const TimedBatch& control, int every) {
  std::vector<TimedBatch> result = {control};
  int since = 0;
  for (const TimedBatch& batch : batches) {
    result.push_back(batch);
    if (++since < every) continue;
    result.push_back(control);
    since = 0;
  }
  if (since > 0) result.push_back(control);
  return result;
}

}  // namespace

TimedCase warm_up(const Timing& timing, const Record& record, std::span<const Draw> draws) {
  const int frames = timing.split.book(Part::warmup, [&] {
    return drawn(timing, record, [&] { return warm_batch(timing.session, draws, timing.measure); });
  });
  return {.record = &record, .draws = draws, .frames = frames};
}

void time(const Timing& timing, std::span<const TimedCase> round) {
  Session& session = timing.session;
  std::vector<TimedBatch> cases;
  cases.reserve(round.size());
  for (const TimedCase& one : round)
    cases.push_back({.name = one.record->case_id, .frames = one.frames, .run_ns = [&timing, &one] {
                       return slowdown_of(timing, *one.record) *
                              drawn(timing, *one.record, [&] { return timing.session.draw_ns(one.draws, one.frames); });
                     }});
  const TimedBatch control{.name = control_case_id(session.device().backend),
                           .frames = session.calibration().frames,
                           .run_ns = [&session] { return session.draw_control_ns(); }};
  const std::vector<TimedBatch> batches = with_control(cases, control, timing.measure.control_every);
  timing.split.book(Part::samples, [&] {
    run_round(batches, [&](std::size_t index, double frame_ns) {
      timing.book.append({.case_id = batches[index].name,
                          .frames = batches[index].frames,
                          .frame_time_ns = frame_ns,
                          .at_ns = timing.clock.now_ns()});
    });
  });
}

}  // namespace reliefbench
