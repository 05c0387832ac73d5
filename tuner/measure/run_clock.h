#pragma once
#include "kernels/base/clock.h"

namespace reliefbench {

struct Run;

/// A run's own clock, by which its samples are ordered: ns since the run began. The wall clock says where in the run a
/// start of it goes on, once; from then on it is the steady clock, which nobody sets back.
class RunClock {
 public:
  RunClock() = default;  ///< of samples that no file keeps: since any moment
  explicit RunClock(double now_ns) : began_ns_(steady_ns() - now_ns) {}

  [[nodiscard]] double now_ns() const { return steady_ns() - began_ns_; }

 private:
  double began_ns_ = 0;
};

/// Where a start of a run goes on: after all that earlier ones drew, though the wall clock may say otherwise.
/// wall_ns: since the run began, by the wall clock
[[nodiscard]] double goes_on_at_ns(const Run& earlier, double wall_ns);

}  // namespace reliefbench
