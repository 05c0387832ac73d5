#pragma once
#include "kernels/judge/score.h"

namespace reliefbench {

/// A frame that is exact, and costs nothing: every number of the hits is 0, the pictures are identical.
inline FrameScore made_score() {
  FrameScore score = judge({}, {}, 1, 1).score;
  score["flip"] = 0;
  score["ssim"] = 1;
  return score;
}

}  // namespace reliefbench
