#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// A part of a picture that one task works on: small enough that its planes stay in the processor's cache.
struct Tile {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// Calls work(tile) for tiles that cover a picture, on all of the machine's threads, in any order.
void for_each_tile(int width, int height, const std::function<void(const Tile&)>& work);
/// Where its first pixel is in a picture of that width.
[[nodiscard]] inline std::size_t first_pixel(const Tile& tile, int width) {
  return static_cast<std::size_t>(tile.y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(tile.x);
}

/// The values of a whole picture, row-major. fill: as below
[[nodiscard]] std::vector<float> map_of_tiles(int width, int height,
                                              const std::function<void(const Tile&, float*, std::size_t)>& fill);
/// Mean over the pixels that have a ray; none where there is no such pixel. The values are looked at while they are in
/// the processor's cache.
/// fill(tile, values, stride): a tile's values, row by row from values[0], values[stride], ... on
[[nodiscard]] std::optional<double> mean_of_tiles(int width, int height, const RayMask& mask,
                                                  const std::function<void(const Tile&, float*, std::size_t)>& fill);

/// exp(-x^2 / (2 sigma^2)) at x = -radius .. radius, in pixels, not normalised.
[[nodiscard]] std::vector<double> gaussian(double sigma, int radius);

/// A kernel times a factor, as the vectorised filters take it.
[[nodiscard]] std::vector<float> scaled(const std::vector<double>& kernel, double factor);

}  // namespace reliefbench
