#include "kernels/judge/tiles.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "kernels/base/lanes.h"
#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

constexpr int kTileWidth = 256;
constexpr int kTileHeight = 64;

double masked_sum(const float* values, const std::uint8_t* has_ray, std::size_t count) {
  const auto lanes = in_lanes<double>(
      count, [&](double& sum, std::size_t i) { sum += has_ray[i] != 0 ? static_cast<double>(values[i]) : 0.0; });
  return std::accumulate(lanes.begin(), lanes.end(), 0.0);
}

int columns_of(int width) { return (width + kTileWidth - 1) / kTileWidth; }
int rows_of(int height) { return (height + kTileHeight - 1) / kTileHeight; }

Tile tile_at(int i, int width, int height) {
  const int x = i % columns_of(width) * kTileWidth;
  const int y = i / columns_of(width) * kTileHeight;
  return {.x = x, .y = y, .width = std::min(kTileWidth, width - x), .height = std::min(kTileHeight, height - y)};
}

}  // namespace

void for_each_tile(int width, int height, const std::function<void(const Tile&)>& work) {
  parallel_for(columns_of(width) * rows_of(height), 0, [&](int i) { work(tile_at(i, width, height)); });
}

std::vector<float> map_of_tiles(int width, int height,
                                const std::function<void(const Tile&, float*, std::size_t)>& fill) {
  std::vector<float> map(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_tile(width, height, [&](const Tile& tile) {
    fill(tile, map.data() + first_pixel(tile, width), static_cast<std::size_t>(width));
  });
  return map;
}

std::optional<double> mean_of_tiles(int width, int height, const RayMask& mask,
                                    const std::function<void(const Tile&, float*, std::size_t)>& fill) {
  assert(mask.has_ray.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (mask.count == 0) return std::nullopt;
  std::vector<double> sums(static_cast<std::size_t>(columns_of(width) * rows_of(height)));
  parallel_for(static_cast<int>(sums.size()), 0, [&](int i) {
    static thread_local std::array<float, std::size_t{kTileWidth} * kTileHeight> values;
    const Tile tile = tile_at(i, width, height);
    fill(tile, values.data(), kTileWidth);
    double& sum = sums[static_cast<std::size_t>(i)];
    for (int y = 0; y < tile.height; ++y)
      sum += masked_sum(values.data() + std::ptrdiff_t{kTileWidth} * y,
                        mask.has_ray.data() + first_pixel(tile, width) + std::ptrdiff_t{width} * y,
                        static_cast<std::size_t>(tile.width));
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0) / static_cast<double>(mask.count);
}

std::vector<double> gaussian(double sigma, int radius) {
  std::vector<double> kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(std::exp(-x * x / (2 * sigma * sigma)));
  return kernel;
}

std::vector<float> scaled(const std::vector<double>& kernel, double factor) {
  std::vector<float> result;
  result.reserve(kernel.size());
  for (const double weight : kernel) result.push_back(static_cast<float>(weight * factor));
  return result;
}

}  // namespace reliefbench
