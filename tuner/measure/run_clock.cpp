#include "tuner/measure/run_clock.h"

#include <algorithm>

#include "tuner/results/store.h"

namespace reliefbench {

double goes_on_at_ns(const Run& earlier, double wall_ns) {
  double last_ns = std::max(wall_ns, 0.0);
  for (const Sample& sample : earlier.samples) last_ns = std::max(last_ns, sample.at_ns);
  for (const BlockState& block : earlier.blocks) last_ns = std::max(last_ns, block.to_ns);
  return last_ns;
}

}  // namespace reliefbench
