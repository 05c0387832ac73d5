#include "tuner/measure/repeated_bake.h"

#include <utility>

#include "kernels/base/clock.h"

namespace reliefbench {

RepeatedBake bake_repeatedly(const std::function<GpuBake()>& bake, int bakes, bool warms_up) {
  if (warms_up) static_cast<void>(bake());
  RepeatedBake made;
  for (int i = 0; i < bakes; ++i) {
    const double start_ns = steady_ns();
    GpuBake one = bake();
    made.times.push_back({.wall_ns = steady_ns() - start_ns - one.transport_ns, .parts = std::move(one.times)});
    made.values = std::move(one.values);
    made.textures = std::move(one.textures);
  }
  return made;
}

}  // namespace reliefbench
