#include "tuner/measure/timing.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace reliefbench {
namespace {

/// A case with the number of frames that make a batch.
struct Subject {
  PreparedCase* prepared;
  int frames;
  int rounds_done;
};

/// What `draw` returns. owner: whose frames it draws, null for the control case
template <typename Draw>
auto drawn_for(PreparedCase* owner, const Draw& draw) {
  try {
    return draw();
  } catch (const Error& error) {
    throw BatchFailed{.owner = owner, .error = error};
  }
}

int frames_for(double frame_ns, const MeasureSpec& measure) {
  return std::max(1, static_cast<int>(std::ceil(measure.batch_ms * 1e6 / std::max(frame_ns, 1.0))));
}

}  // namespace

int warm_up(Session& session, const Draw& draw, const MeasureSpec& measure) {
  double previous_ns = session.draw_ns(draw, 1);
  int frames = frames_for(previous_ns, measure);
  for (int batch = 0; batch < measure.warmup_batches_max; ++batch) {
    const double frame_ns = session.draw_ns(draw, frames) / frames;
    const bool settled = std::abs(frame_ns - previous_ns) <= 0.05 * frame_ns;
    previous_ns = frame_ns;
    frames = frames_for(frame_ns, measure);
    if (settled) break;
  }
  return frames;
}

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

void time_block(const std::vector<PreparedCase*>& cases, const TimingContext& context) {
  Session& session = context.session;
  std::vector<Subject> subjects;
  context.split.book(Part::warmup, [&] {
    for (PreparedCase* prepared : cases) {
      const auto earlier = context.samples_so_far.find(prepared->record.case_id);
      const int done = earlier == context.samples_so_far.end() ? 0 : static_cast<int>(earlier->second.size());
      if (done >= context.measure.samples) continue;
      const auto hold = context.mark.hold(prepared->record.case_id);
      const int frames = drawn_for(prepared, [&] { return warm_up(session, prepared->draw, context.measure); });
      subjects.push_back({.prepared = prepared, .frames = frames, .rounds_done = done});
    }
  });

  std::mt19937_64 random(context.seed);
  const std::string control_id = control_case_id(session.device().backend);
  const TimedBatch control{.name = control_id, .frames = session.calibration().frames, .run_ns = [&session] {
                             return drawn_for(nullptr, [&] { return session.draw_control_ns(); });
                           }};
  for (int round = 0; round < context.measure.samples; ++round) {
    std::vector<Subject*> order;
    for (Subject& subject : subjects)
      if (subject.rounds_done < context.measure.samples) order.push_back(&subject);
    if (order.empty()) break;
    std::shuffle(order.begin(), order.end(), random);

    std::vector<TimedBatch> own;
    own.reserve(order.size());
    for (Subject* subject : order)
      own.push_back({.name = subject->prepared->record.case_id,
                     .frames = subject->frames,
                     .run_ns = [&session, &context, subject] {
                       const auto hold = context.mark.hold(subject->prepared->record.case_id);
                       return drawn_for(subject->prepared,
                                        [&] { return session.draw_ns(subject->prepared->draw, subject->frames); });
                     }});
    const std::vector<TimedBatch> batches = with_control(own, control, context.measure.control_every);
    auto next = order.begin();
    context.split.book(Part::samples, [&] {
      run_round(batches, [&](std::size_t index, double frame_ns) {
        const bool is_control = batches[index].name == control_id;
        context.on_sample({.case_id = batches[index].name,
                           .round = is_control ? 0 : (*next++)->rounds_done++,
                           .frames = batches[index].frames,
                           .frame_time_ns = frame_ns,
                           .at_ns = context.clock_ns()});
      });
    });
    context.on_progress((round + 1.0) / context.measure.samples);
  }
}

}  // namespace reliefbench
