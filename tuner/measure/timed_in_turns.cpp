#include "tuner/measure/timed_in_turns.h"

#include <algorithm>
#include <random>

#include "tuner/measure/draw_block.h"

namespace reliefbench {

TimesInTurns timed_in_turns(const TurnsBench& bench, std::span<const TimedCase> cases,
                            const std::function<void(int)>& on_round) {
  Session& session = bench.session;
  SampleBook book(SampleBook::Control{.id = control_case_id(session.device().backend),
                                      .reference_ns = session.calibration().reference_ns});
  const Timing timing{.session = session,
                      .book = book,
                      .measure = bench.measure,
                      .split = bench.split,
                      .cooling_pause_s = bench.cooling_pause_s,
                      .progress = &bench.progress};
  std::vector<TimedCase> order;
  order.reserve(cases.size());
  for (const TimedCase& one : cases) order.push_back(warm_up(timing, *one.record, one.draws));
  std::mt19937_64 random(1);
  TimesInTurns result;
  result.held_back = draw_block(timing, [&] {
    for (int round = 1; round <= bench.measure.samples; ++round) {
      std::shuffle(order.begin(), order.end(), random);
      time(timing, order);
      on_round(round);
    }
  });
  if (!result.held_back.empty()) return result;
  result.times_ns.reserve(cases.size());
  for (const TimedCase& one : cases) result.times_ns.push_back(book.times(one.record->case_id));
  return result;
}

}  // namespace reliefbench
