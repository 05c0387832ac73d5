#pragma once
#include <cstddef>

#include "kernels/base/parallel.h"
#include "kernels/trace/view.h"

namespace reliefbench {

/// Calls use(i, x, y) for the frame's pixels, row by row from the top, on all threads.
template <typename Use>
void for_each_pixel(const FrameUniforms& frame, const Use& use) {
  const int width = frame.sizes[0];
  parallel_for(frame.sizes[1], 0, [&](int y) {
    for (int x = 0; x < width; ++x)
      use(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x), x, y);
  });
}

}  // namespace reliefbench
