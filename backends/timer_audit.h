#pragma once
#include <optional>
#include <string>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

/// What the audit found for one timer of one device.
struct TimerAudit {
  Timer timer = Timer::fenced_wall;
  bool valid = false;
  double wall_ratio = 0;  ///< device time / fenced wall time, at work 2N
  double doubling = 0;    ///< time of work 2N / time of work N
  std::string reason;     ///< why it was rejected, or ""
};

/// Known work N and 2N, of fragments or by_compute: a timer is believed if it agrees with the fenced wall clock within
/// 5 % and doubles with the work within 10 %. The wall clock itself must double. Medians of seven interleaved rounds.
/// What agrees and does not double is measured again. So is, four times more in any case, what is off by at most 20 %:
/// it is judged by the seven quietest rounds of them all, those with the least wall time. A busy machine adds to the
/// wall clock of some rounds, and a liar is off in the quiet ones, too.
[[nodiscard]] std::vector<TimerAudit> audit_timers(Backend& backend, Dialect dialect, bool by_compute = false);
/// What is left of an audit by the work of compute shaders: a timer is valid where it is so by both.
[[nodiscard]] std::vector<TimerAudit> with_compute(std::vector<TimerAudit> audit,
                                                   const std::vector<TimerAudit>& by_compute);

/// The timer that times the parts of compute jobs, among some.
[[nodiscard]] const TimerAudit* find_part_clock(const std::vector<TimerAudit>& audit);
/// What is found of that one by work of compute shaders; none: the device has no such clock. A device that cannot draw
/// the work has one that is not valid.
[[nodiscard]] std::optional<TimerAudit> audit_part_clock(Backend& backend, Dialect dialect);

/// The timer to measure with: the first valid device timer, else the fenced wall clock.
/// throws: Error(environment) when not even the wall clock is valid
[[nodiscard]] Timer choose_timer(const std::vector<TimerAudit>& audit);

}  // namespace reliefbench
