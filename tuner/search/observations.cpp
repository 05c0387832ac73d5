#include "tuner/search/observations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "kernels/error.h"
#include "tuner/search/search.h"

namespace reliefbench {

double Observed::deviations() const {
  double sum = 0;
  for (const double block : blocks) sum += (block - mean) * (block - mean);
  return sum;
}

void draw_block(TimeSource& times, std::size_t candidate, Observed& observed) {
  std::array<double, kBlock> block{};
  for (double& log_time : block) {
    const auto index = static_cast<int>(observed.frames.size());
    const double time_ns = times.frame_ns(candidate, index);
    if (!(time_ns > 0) || std::isinf(time_ns))
      fail_input("sample {} of setting {} took {} ns: not a time", index, candidate, time_ns);
    log_time = std::log(time_ns);
    observed.frames.push_back(log_time);
  }
  std::ranges::sort(block);
  observed.blocks.push_back(block[kBlock / 2]);
  // Summed anew, so that the mean does not depend on how it was come by.
  observed.mean = std::accumulate(observed.blocks.begin(), observed.blocks.end(), 0.0) /
                  static_cast<double>(observed.blocks.size());
}

}  // namespace reliefbench
