#pragma once
#include <functional>
#include <vector>

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

/// exp(-x^2 / (2 sigma^2)) at x = -radius .. radius, in pixels, not normalised.
[[nodiscard]] std::vector<double> gaussian(double sigma, int radius);

/// A kernel times a factor, as the vectorised filters take it.
[[nodiscard]] std::vector<float> scaled(const std::vector<double>& kernel, double factor);

}  // namespace reliefbench
