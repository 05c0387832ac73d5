#include "kernels/judge/tiles.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

constexpr int kTileWidth = 256;
constexpr int kTileHeight = 64;

}  // namespace

void for_each_tile(int width, int height, const std::function<void(const Tile&)>& work) {
  const int columns = (width + kTileWidth - 1) / kTileWidth;
  const int rows = (height + kTileHeight - 1) / kTileHeight;
  parallel_for(columns * rows, 0, [&](int i) {
    const int x = i % columns * kTileWidth;
    const int y = i / columns * kTileHeight;
    work({.x = x, .y = y, .width = std::min(kTileWidth, width - x), .height = std::min(kTileHeight, height - y)});
  });
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
