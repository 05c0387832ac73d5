#include "tuner/measure/device_times.h"

#include <vector>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "tuner/measure/timing.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

/// What `draw` returns. throws: CaseFailed where the device does not draw the case
template <typename Draw>
auto drawn_or_failed(const PreparedCase& prepared, const Draw& draw) {
  try {
    return draw();
  } catch (const Error& error) {
    CaseFailed failed{prepared.record};
    failed.record.status = status_of(error.fault(), Status::unsupported);
    failed.record.reason = error.what();
    throw failed;
  }
}

}  // namespace

void DeviceTimes::draw(std::span<const Wanted> round) {
  Session& session = context_.session;
  std::vector<TimedBatch> batches;
  for (const Wanted& wanted : round) {
    const std::string id = wanted.spec.id();
    Ready& one = ready(wanted, id);
    batches.push_back({.name = id, .frames = one.frames, .run_ns = [this, &session, &one, id] {
                         const auto hold = context_.mark.hold(id);
                         return drawn_or_failed(one.prepared,
                                                [&] { return session.draw_ns(one.prepared.draw, one.frames); });
                       }});
  }
  const TimedBatch control{.name = control_case_id(session.device().backend),
                           .frames = session.calibration().frames,
                           .run_ns = [&session] { return session.draw_control_ns(); }};
  batches = with_control(batches, control, context_.measure.control_every);
  context_.split.book(Part::samples, [&] {
    run_round(batches, [&](std::size_t index, double frame_ns) {
      const std::string& id = batches[index].name;
      context_.book.append({.case_id = id,
                            .round = static_cast<int>(context_.book.samples(id).size()),
                            .frames = batches[index].frames,
                            .frame_time_ns = frame_ns,
                            .at_ns = unix_ns() - context_.started_ns});
    });
  });
}

DeviceTimes::Ready& DeviceTimes::ready(const Wanted& wanted, const std::string& id) {
  const auto found = ready_.find(id);
  if (found != ready_.end()) return *found->second;
  const auto hold = context_.mark.hold(id);
  auto fresh = std::make_unique<Ready>(Ready{.spec = wanted.spec, .prepared = {}, .frames = 1});
  fresh->prepared = context_.preparer.prepare_to_time(fresh->spec, *wanted.scene);
  if (fresh->prepared.record.status != Status::ok) throw CaseFailed{fresh->prepared.record};
  fresh->frames = context_.split.book(Part::warmup, [&] {
    return drawn_or_failed(fresh->prepared,
                           [&] { return warm_up(context_.session, fresh->prepared.draw, context_.measure); });
  });
  return *ready_.emplace(id, std::move(fresh)).first->second;
}

}  // namespace reliefbench
