#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// A pseudo-random number in [0, 1) from lattice coordinates.
inline float lattice_noise(int x, int y, int seed) {
  auto h = static_cast<std::uint32_t>(x) * 374761393U + static_cast<std::uint32_t>(y) * 668265263U +
           static_cast<std::uint32_t>(seed) * 2654435761U;
  h = (h ^ (h >> 13U)) * 1274126177U;
  h ^= h >> 16U;
  return static_cast<float>(h >> 8U) / 16777216.0F;
}

inline Heightfield make_map(int width, int height, const std::function<float(int, int)>& value) {
  Heightfield map{.width = width, .height = height, .texels = {}};
  map.texels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) map.texels.push_back(value(x, y));
  }
  return map;
}

/// Eight octaves of smooth value noise, tileable.
inline Heightfield fbm_map(int width, int height) {
  const auto octave = [&](float u, float v, int period) {
    const float x = u * static_cast<float>(period);
    const float y = v * static_cast<float>(period);
    const int i = static_cast<int>(x);
    const int j = static_cast<int>(y);
    const auto smooth = [](float f) { return f * f * (3 - 2 * f); };
    const auto corner = [&](int a, int b) { return lattice_noise((i + a) % period, (j + b) % period, period); };
    const float fx = smooth(x - static_cast<float>(i));
    return std::lerp(std::lerp(corner(0, 0), corner(1, 0), fx), std::lerp(corner(0, 1), corner(1, 1), fx),
                     smooth(y - static_cast<float>(j)));
  };
  Heightfield map = make_map(width, height, [&](int x, int y) {
    float sum = 0;
    float amplitude = 0.5F;
    for (int period = 4; period <= std::min(512, std::max(width, height) / 2); period *= 2, amplitude *= 0.5F) {
      sum += amplitude * octave(static_cast<float>(x) / static_cast<float>(width),
                                static_cast<float>(y) / static_cast<float>(height), period);
    }
    return sum;
  });
  const auto [low, high] = std::ranges::minmax(map.texels);
  for (float& texel : map.texels) texel = high > low ? (texel - low) / (high - low) : 0;
  return map;
}

/// Staggered courses of bricks with bevelled edges over rough mortar.
inline Heightfield bricks_map(int width, int height) {
  const int course = std::max(2, height / 16);
  const int brick = std::max(2, width / 8);
  return make_map(width, height, [&](int x, int y) {
    const int row = y / course;
    const int shifted = (x + (row % 2) * (brick / 2)) % width;
    const int edge = std::min({shifted % brick, brick - 1 - shifted % brick, y % course, course - 1 - y % course});
    const float bevel = std::min(1.0F, static_cast<float>(edge) * 128.0F / static_cast<float>(width));
    return 0.1F * lattice_noise(x, y, 3) + bevel * (0.6F + 0.3F * lattice_noise(shifted / brick, row, 5));
  });
}

/// Rare single-texel needles over low noise.
inline Heightfield spikes_map(int width, int height) {
  return make_map(width, height, [](int x, int y) {
    return lattice_noise(x, y, 7) < 0.002F ? 0.3F + 0.7F * lattice_noise(x, y, 9) : 0.02F * lattice_noise(x, y, 1);
  });
}

inline Heightfield noise_map(int width, int height) {
  return make_map(width, height, [](int x, int y) { return lattice_noise(x, y, 11); });
}

inline Heightfield checker_map(int width, int height) {
  return make_map(width, height, [](int x, int y) { return static_cast<float>((x + y) % 2); });
}

inline Heightfield cliff_map(int width, int height) {
  return make_map(width, height, [&](int x, int) { return x < width / 2 ? 0.0F : 1.0F; });
}

inline Heightfield constant_map(int width, int height) {
  return make_map(width, height, [](int, int) { return 0.5F; });
}

inline Heightfield pyramids_map(int width, int height) {
  return make_map(width, height, [](int x, int y) {
    return static_cast<float>(std::min(4 - std::abs(x % 9 - 4), 4 - std::abs(y % 9 - 4))) / 4;
  });
}

/// Heights of very different size, denormal ones among them: differences that do not fit a float.
inline Heightfield tiny_map(int width, int height) {
  return make_map(width, height, [](int x, int y) {
    return std::ldexp(lattice_noise(x, y, 13), -static_cast<int>(160 * lattice_noise(x, y, 17)));
  });
}

struct MapSize {
  int width, height;
};

inline constexpr Wrap kWraps[] = {Wrap::repeat, Wrap::clamp};

struct ConeTestMap {
  std::string_view id;
  Heightfield (*make)(int width, int height);
};
inline constexpr ConeTestMap kConeTestMaps[] = {
    {"fbm", fbm_map},           {"bricks", bricks_map},     {"spikes", spikes_map},
    {"noise", noise_map},       {"checker", checker_map},   {"cliff", cliff_map},
    {"constant", constant_map}, {"pyramids", pyramids_map}, {"tiny", tiny_map},
};

/// Heights as they are or, for a kind that needs them, with floors, here and there above the tops.
inline Heightfield heights_for(MapKind kind, Heightfield heights) {
  if (!find_map(kind).is_solid) return heights;
  for (std::size_t i = 0; i < heights.texels.size(); ++i)
    heights.floors.push_back(i % 7 < 2 ? 1.0F : heights.texels[i] * lattice_noise(static_cast<int>(i), 3, 1));
  return heights;
}

}  // namespace reliefbench
