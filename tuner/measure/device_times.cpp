#include "tuner/measure/device_times.h"

#include <vector>

#include "kernels/base/clock.h"
#include "tuner/measure/harness.h"
#include "tuner/measure/timing.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
void DeviceTimes::draw(const Case& c, const SceneSpec& scene) {
  Session& session = context_.session;
  const std::string id = c.id();
  Ready& one = ready(c, scene, id);
  if (until_control_ <= 0) {
    draw_batch(control_case_id(session.device().backend), session.calibration().frames,
               [&] { return session.draw_control_ns(); });
    until_control_ = context_.measure.control_every;
  }
  --until_control_;
  draw_batch(id, one.frames, [&] { return session.draw_ns(one.prepared.draw, one.frames); });
}

DeviceTimes::Ready& DeviceTimes::ready(const Case& c, const SceneSpec& scene, const std::string& id) {
  const auto found = ready_.find(id);
  if (found != ready_.end()) return *found->second;
  auto fresh = std::make_unique<Ready>(Ready{.spec = c, .prepared = {}, .frames = 1});
  fresh->prepared = context_.preparer.prepare_to_time(fresh->spec, scene);
  if (fresh->prepared.record.status != Status::ok) throw CaseFailed{fresh->prepared.record};
  fresh->frames = context_.split.book(
      Part::warmup, [&] { return warm_up(context_.session, fresh->prepared.draw, context_.measure); });
  return *ready_.emplace(id, std::move(fresh)).first->second;
}

void DeviceTimes::draw_batch(const std::string& case_id, int frames, const std::function<double()>& run_ns) {
  context_.split.book(Part::samples, [&] {
    run_round(std::vector{TimedBatch{.name = case_id, .frames = frames, .run_ns = run_ns}},
              [&](std::size_t, double frame_ns) {
                context_.book.append({.case_id = case_id,
                                      .round = static_cast<int>(context_.book.times(case_id).size()),
                                      .frames = frames,
                                      .frame_time_ns = frame_ns,
                                      .at_ns = unix_ns() - context_.started_ns});
              });
  });
}

}  // namespace reliefbench
