#include "tuner/measure/draw_block.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

// Boost clocks wander by 5 % with the temperature, unthrottled. The control case takes a lower clock out of times that
// depend on it as its own arithmetic does; one that waits for memory, whose clock stays, is corrected too far, by at
// most what the clock lost: a tenth here.
constexpr double kLeastClockShare = 0.9;

bool is_serious(std::string_view reason) { return reason != kPowerCap; }

std::string with_state(std::string what, const DeviceState& after) {
  DeviceState rest = after;
  rest.held_back.clear();
  rest.throttle_events.reset();
  if (const std::string text = state_text(rest); !text.empty()) what += ", " + text;
  return what;
}

}  // namespace

std::string held_back_by(const DeviceState& calibrated, const DeviceState& before, const DeviceState& after,
                         double control_slowdown, double most_slowdown) {
  std::vector<std::string> reasons;
  std::ranges::set_difference(after.held_back, calibrated.held_back, std::back_inserter(reasons));
  const bool has_serious = std::ranges::any_of(reasons, is_serious);
  const bool is_slower = after.clock_mhz && calibrated.clock_mhz &&
                         *after.clock_mhz < kLeastClockShare * *calibrated.clock_mhz &&
                         (!reasons.empty() || control_slowdown > 1 / kLeastClockShare);
  if (has_serious || (is_slower && !reasons.empty()))
    return with_state(fmt::format("{}", fmt::join(reasons, ", ")), after);
  if (before.throttle_events && after.throttle_events && *after.throttle_events > *before.throttle_events)
    return with_state(
        fmt::format("the processor was slowed down {:.0f} times", *after.throttle_events - *before.throttle_events),
        after);
  if (is_slower)
    return with_state(
        fmt::format("a clock of {:.0f} MHz where it was calibrated at {:.0f}", *after.clock_mhz, *calibrated.clock_mhz),
        after);
  if (control_slowdown > most_slowdown)
    return fmt::format("the control case ran {:.1f} times slower than when the run began", control_slowdown);
  return "";
}

std::string held_back_note(const Session& session) {
  const DeviceState& state = session.calibration().state;
  if (std::ranges::none_of(state.held_back, is_serious)) return "";
  return fmt::format("{} was held back when the run began, and its times are of that: {}", session.device().name,
                     state_text(state));
}

std::string draw_block(const Timing& timing, const std::function<void()>& draw, double most_slowdown) {
  Session& session = timing.session;
  const Calibration& calibration = session.calibration();
  for (int again = 0;; ++again) {
    BlockState block{.backend = session.device().backend, .before = session.state()};
    block.from_ns = timing.clock.now_ns();
    draw();
    block.after = session.state();
    block.to_ns = timing.clock.now_ns();
    std::vector<double> control_ns;
    for (const Sample& sample : timing.book.control_samples())
      if (block.has(sample)) control_ns.push_back(sample.frame_time_ns);
    if (control_ns.empty()) return "";  // the book lacked nothing
    block.held_back = held_back_by(calibration.state, block.before, block.after,
                                   median(control_ns) / calibration.reference_ns, most_slowdown);
    timing.book.close(block);
    if (block.held_back.empty() || again == kMostAgain) return block.held_back;
    if (timing.progress != nullptr)
      timing.progress->wait(
          fmt::format("{} is cooling for {:g} s: {}", session.device().name, timing.cooling_pause_s, block.held_back));
    timing.split.book(Part::cooling,
                      [&] { std::this_thread::sleep_for(std::chrono::duration<double>(timing.cooling_pause_s)); });
  }
}

}  // namespace reliefbench
