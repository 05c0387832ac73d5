#pragma once
#include <cstddef>
#include <vector>

#include "tuner/search/space.h"

namespace reliefbench {

/// What was drawn of one setting, on the scale of log ns.
struct Observed {
  std::vector<double> frames;  ///< log time of every frame, in the order drawn
  std::vector<double> blocks;  ///< log time of the median of each block
  double mean = 0;             ///< of the blocks
  int order = -1;              ///< how many settings were timed before it; -1 where not timed

  [[nodiscard]] bool is_measured() const { return !blocks.empty(); }
  [[nodiscard]] int count() const { return static_cast<int>(blocks.size()); }
  /// Sum of the blocks' squared deviations from their mean.
  [[nodiscard]] double deviations() const;
};

/// Draws the next block of kBlock frames.
/// throws: Error(bad_input): a time that is not a positive number
void draw_block(TimeSource& times, std::size_t candidate, Observed& observed);

}  // namespace reliefbench
