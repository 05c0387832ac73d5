#include "kernels/maps/mip_chain.h"

#include <algorithm>
#include <functional>

#include "kernels/maps/map_kind.h"

namespace reliefbench {
namespace {

/// Texels [first, last] of an axis, not yet wrapped.
struct Footprint {
  int first, last;
};

/// Of n texels, those that any point over the coarse texel i of m is interpolated from. The coarse texel reaches over
/// uv ((i - 1/2) / m, (i + 3/2) / m), texel j over ((j - 1/2) / n, (j + 3/2) / n): both open, since weights vanish at
/// their ends, so that they meet where n (2i - 1) - 3m < 2m j < n (2i + 3) + m.
Footprint footprint(int i, int n, int m) {
  const auto floor_div = [](int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); };
  return {.first = floor_div(n * (2 * i - 1) - 3 * m, 2 * m) + 1, .last = floor_div(n * (2 * i + 3) + m - 1, 2 * m)};
}

/// A plane of values, `channels` interleaved.
struct Plane {
  int width, height, channels;
  std::vector<float> values;
  [[nodiscard]] std::size_t index(int x, int y, int channel) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(channel);
  }
};

/// The plane with its rows shortened to half: of each support the value that comes first by `before`.
template <typename Before>
Plane halved_rows(const Plane& fine, Wrap wrap, const Before& before) {
  Plane coarse{.width = level_side(fine.width, 1), .height = fine.height, .channels = fine.channels, .values = {}};
  coarse.values.reserve(coarse.index(0, coarse.height, 0));
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x)
      for (int channel = 0; channel < coarse.channels; ++channel) {
        const auto [first, last] = footprint(x, fine.width, coarse.width);
        float value = fine.values[fine.index(wrapped(first, fine.width, wrap), y, channel)];
        for (int j = first + 1; j <= last; ++j)
          value = std::min(value, fine.values[fine.index(wrapped(j, fine.width, wrap), y, channel)], before);
        coarse.values.push_back(value);
      }
  return coarse;
}

Plane transposed(const Plane& plane) {
  Plane result{.width = plane.height, .height = plane.width, .channels = plane.channels, .values = {}};
  result.values.reserve(plane.values.size());
  for (int x = 0; x < plane.width; ++x)
    for (int y = 0; y < plane.height; ++y)
      for (int channel = 0; channel < plane.channels; ++channel)
        result.values.push_back(plane.values[plane.index(x, y, channel)]);
  return result;
}

/// The plane with its rows shortened to half: each value the mean of what it covers, parts of texels in proportion.
Plane mean_rows(const Plane& fine) {
  Plane coarse{.width = level_side(fine.width, 1), .height = fine.height, .channels = fine.channels, .values = {}};
  coarse.values.reserve(coarse.index(0, coarse.height, 0));
  const double share = 1.0 * fine.width / coarse.width;  // of texels that a coarse one covers
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x)
      for (int channel = 0; channel < coarse.channels; ++channel) {
        const double begin = x * share;
        const double end = std::min(begin + share, 1.0 * fine.width);
        double sum = 0;
        for (int j = static_cast<int>(begin); j < end; ++j)
          sum += (std::min(end, j + 1.0) - std::max(begin, 1.0 * j)) *
                 static_cast<double>(fine.values[fine.index(j, y, channel)]);
        coarse.values.push_back(static_cast<float>(sum / share));
      }
  return coarse;
}

Plane mean_halved(const Plane& fine) { return transposed(mean_rows(transposed(mean_rows(fine)))); }

/// The support of a texel is a rectangle: along the rows, then along the columns.
template <typename Before>
Plane halved(const Plane& fine, Wrap wrap, const Before& before) {
  return transposed(halved_rows(transposed(halved_rows(fine, wrap, before)), wrap, before));
}

}  // namespace

std::vector<MipLevel> mip_chain(const Heightfield& heights, std::span<const float> ratios, int ratios_per_texel,
                                Wrap wrap, Mips mips) {
  Plane height_plane{.width = heights.width, .height = heights.height, .channels = 1, .values = heights.texels};
  Plane ratio_plane{.width = heights.width,
                    .height = heights.height,
                    .channels = ratios_per_texel,
                    .values = {ratios.begin(), ratios.end()}};
  std::vector<MipLevel> levels;
  while (height_plane.width > 1 || height_plane.height > 1) {
    height_plane = mips == Mips::mean ? mean_halved(height_plane) : halved(height_plane, wrap, std::greater<>());
    ratio_plane = halved(ratio_plane, wrap, std::less<>());
    levels.push_back(
        {.heights = {.width = height_plane.width, .height = height_plane.height, .texels = height_plane.values},
         .ratios = ratio_plane.values});
  }
  return levels;
}

}  // namespace reliefbench
