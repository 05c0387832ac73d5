#pragma once
#include <cstddef>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// Maximum pyramid over texels. Level 0 holds the texels, a node of level n covers 2^n x 2^n of them. Sides are rounded
/// up, so the last row and column of a map of any size are covered; then padded to even with kNothing, so that every
/// node but the root has four children to read.
class MaxPyramid {
 public:
  static constexpr float kNothing = -1;  ///< under every height

  struct Level {
    std::size_t stride = 0;  ///< nodes from one row to the next
    std::vector<float> nodes;
    [[nodiscard]] float at(std::size_t x, std::size_t y) const { return nodes[y * stride + x]; }
  };

  explicit MaxPyramid(const Heightfield& heights);
  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }

 private:
  std::vector<Level> levels_;  ///< the last one holds the root at (0, 0)
};

}  // namespace reliefbench
