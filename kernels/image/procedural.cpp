#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/parallel.h"
#include "kernels/image/heightmap.h"

// Only integer hashes, + - * / and floor, all of them exact or correctly rounded: the same bits on every machine.
namespace reliefbench {
namespace {

/// surface(u, v) at every texel centre.
template <typename Surface>
Heightfield sampled(int width, int height, const Surface& surface) {
  Heightfield field{.width = width, .height = height, .texels = {}};
  field.texels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  parallel_for(height, 0, [&](int y) {
    for (int x = 0; x < width; ++x)
      field.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          static_cast<float>(surface((x + 0.5) / width, (y + 0.5) / height));
  });
  return field;
}

/// The finaliser of MurmurHash3 over a lattice point, as a number in [0, 1) with 24 bits.
double random_at(int x, int y, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9e3779b1U ^ static_cast<std::uint32_t>(y) * 0x85ebca77U;
  h ^= seed * 0xc2b2ae3dU;
  h = (h ^ (h >> 16)) * 0x85ebca6bU;
  h = (h ^ (h >> 13)) * 0xc2b2ae35U;
  return ((h ^ (h >> 16)) >> 8) * 0x1p-24;
}

/// Value noise in [0, 1) with `cells` lattice cells a tile, repeating at the tile's edge.
double noise(double u, double v, int cells, std::uint32_t seed) {
  const int x = static_cast<int>(std::floor(u * cells));
  const int y = static_cast<int>(std::floor(v * cells));
  const auto fade = [](double f) { return f * f * f * (f * (f * 6 - 15) + 10); };
  const double fx = fade(u * cells - x);
  const double fy = fade(v * cells - y);
  const auto lattice = [&](int i, int j) { return random_at((x + i) % cells, (y + j) % cells, seed); };
  const double top = lattice(0, 0) + fx * (lattice(1, 0) - lattice(0, 0));
  const double bottom = lattice(0, 1) + fx * (lattice(1, 1) - lattice(0, 1));
  return top + fy * (bottom - top);
}

/// Octaves of shape(noise), from 4 cells a tile down to 4 texels a cell, each half as high as the one before.
template <typename Shape>
Heightfield octaves(int width, int height, std::uint32_t seed, const Shape& shape) {
  constexpr int kCoarsest = 4;
  const int finest = std::max(kCoarsest, std::min(width, height) / 4);
  Heightfield field = sampled(width, height, [&](double u, double v) {
    double sum = 0;
    double amplitude = 1;
    std::uint32_t octave_seed = seed * 64;
    for (int cells = kCoarsest; cells <= finest; cells *= 2) {
      sum += amplitude * shape(noise(u, v, cells, ++octave_seed));
      amplitude /= 2;
    }
    return sum;
  });
  // The full range is used, so that equal depths mean the same on every seed and size.
  const auto [low, high] = std::minmax_element(field.texels.begin(), field.texels.end());
  const float base = *low;
  const float range = *high - base;
  for (float& texel : field.texels) texel = (texel - base) / range;
  return field;
}

Heightfield fbm(int width, int height, std::uint32_t seed) {
  return octaves(width, height, seed, [](double n) { return n; });
}

Heightfield ridged(int width, int height, std::uint32_t seed) {
  return octaves(width, height, seed, [](double n) {
    const double ridge = 1 - std::abs(2 * n - 1);
    return ridge * ridge;
  });
}

Heightfield bricks(int width, int height, std::uint32_t seed) {
  constexpr int kColumns = 4;
  constexpr int kRows = 8;
  constexpr double kJoint = 0.06;  // half the joint's width, and the bevel's, in brick heights
  return sampled(width, height, [&](double u, double v) {
    const int row = static_cast<int>(v * kRows);
    const double along = u * kColumns + (row % 2) * 0.5;
    const int column = static_cast<int>(along);
    const double fx = along - column;
    const double fy = v * kRows - row;
    // Bricks are twice as long as high.
    const double edge = std::min(2 * std::min(fx, 1 - fx), std::min(fy, 1 - fy));
    const double face = std::clamp((edge - kJoint) / kJoint, 0.0, 1.0);
    const double top = 0.8 + 0.2 * random_at(column % kColumns, row, seed);
    return (0.1 + face * (top - 0.1)) * (1 - 0.1 * noise(u, v, 32, seed + 1));
  });
}

Heightfield spikes(int width, int height, std::uint32_t seed) {
  constexpr int kBlock = 16;
  Heightfield field{.width = width, .height = height, .texels = {}};
  field.texels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; y += kBlock) {
    for (int x = 0; x < width; x += kBlock) {
      const int spike_x = x + static_cast<int>(random_at(x, y, seed) * std::min(kBlock, width - x));
      const int spike_y = y + static_cast<int>(random_at(x, y, seed + 1) * std::min(kBlock, height - y));
      field.texels[static_cast<std::size_t>(spike_y) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(spike_x)] = static_cast<float>(0.25 + 0.75 * random_at(x, y, seed + 2));
    }
  }
  return field;
}

Heightfield posts(int width, int height, std::uint32_t) {
  Heightfield field{.width = width, .height = height, .texels = {}};
  field.texels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  field.texels[field.index(width - 1, 3 * height / 4)] = 1;
  field.texels[field.index(width / 4, height - 1)] = 1;
  field.texels[field.index(0, height / 4)] = 1;
  field.texels[field.index(3 * width / 4, 0)] = 1;
  return field;
}

Heightfield checker(int width, int height, std::uint32_t) {
  return sampled(width, height,
                 [&](double u, double v) { return (static_cast<int>(u * width) + static_cast<int>(v * height)) % 2; });
}

Heightfield cliff(int width, int height, std::uint32_t) {
  return sampled(width, height, [](double u, double) { return u < 0.5 ? 0 : 1; });
}

Heightfield pyramids(int width, int height, std::uint32_t) {
  return sampled(width, height, [](double u, double v) {
    const auto from_centre = [](double x) { return std::abs(2 * (x * 4 - std::floor(x * 4)) - 1); };
    return 1 - std::max(from_centre(u), from_centre(v));
  });
}

Heightfield plateau(int width, int height, std::uint32_t) {
  return sampled(width, height, [](double u, double v) {
    const double from_centre = std::max(std::abs(u - 0.5), std::abs(v - 0.5));
    return std::clamp((0.375 - from_centre) / 0.125, 0.0, 1.0);
  });
}

Heightfield constant(int width, int height, std::uint32_t) {
  return sampled(width, height, [](double, double) { return 0.5; });
}

/// Of the first sign, so that surfaces go on smoothly where they cross.
double signed_root(double square) { return square < 0 ? -std::sqrt(-square) : std::sqrt(square); }

/// A solid between middle - reach(u, v) and middle + reach(u, v), both cut to [0, 1]: nothing where that is negative.
template <typename Reach>
Heightfield solid_round(int width, int height, double middle, const Reach& reach) {
  Heightfield solid =
      sampled(width, height, [&](double u, double v) { return std::clamp(middle + reach(u, v), 0.0, 1.0); });
  solid.floors =
      sampled(width, height, [&](double u, double v) { return std::clamp(middle - reach(u, v), 0.0, 1.0); }).texels;
  return solid;
}

Heightfield ball(int width, int height, std::uint32_t) {
  constexpr double kRadius = 0.375;  // and 0.4 of the height
  return solid_round(width, height, 0.5, [](double u, double v) {
    const double q = ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5)) / (kRadius * kRadius);
    return 0.4 * signed_root(1 - q);
  });
}

Heightfield half_torus(int width, int height, std::uint32_t) {
  constexpr double kRadius = 0.28;
  constexpr double kTube = 0.125;
  constexpr double kFloor = 0.125;
  Heightfield solid = sampled(width, height, [](double u, double v) {
    const double from_tube = std::sqrt((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5)) - kRadius;
    return std::max(0.0, kFloor + 0.75 * signed_root(1 - from_tube * from_tube / (kTube * kTube)));
  });
  solid.floors.assign(solid.texels.size(), static_cast<float>(kFloor));
  return solid;
}

Heightfield goblet(int width, int height, std::uint32_t) {
  constexpr double kEnd = 0.0625;  // of its axis, which lies along v
  return solid_round(width, height, 0.5, [](double u, double v) {
    const double along = 2 * v - 1;
    const double radius = 0.0625 + 0.3 * along * along;
    const double round = signed_root(radius * radius - (u - 0.5) * (u - 0.5));
    return std::min(1.25 * round, 4 * (std::min(v, 1 - v) - kEnd));
  });
}

Heightfield grille(int width, int height, std::uint32_t) {
  constexpr double kHalf = 0.15;  // a bar's half width, in steps between bars
  const auto bar = [](double x) {
    const double from_axis = (4 * x - std::floor(4 * x) - 0.5) / kHalf;
    return signed_root(1 - from_axis * from_axis);
  };
  return solid_round(width, height, 0.5, [&](double u, double v) { return 0.25 * std::max(bar(u), bar(v)); });
}

Heightfield specks(int width, int height, std::uint32_t seed) {
  Heightfield solid = spikes(width, height, seed);
  solid.floors.reserve(solid.texels.size());
  for (float& texel : solid.texels) {
    solid.floors.push_back(texel > 0 ? 0.25F * texel : 0.5F);
    if (texel == 0) texel = 0.5F;
  }
  return solid;
}

Heightfield nothing(int width, int height, std::uint32_t seed) {
  Heightfield solid = fbm(width, height, seed);
  for (const float texel : solid.texels) solid.floors.push_back(0.5F + 0.5F * texel);
  for (float& texel : solid.texels) texel *= 0.5F;
  return solid;
}

constexpr std::array kProcedurals{
    ProceduralRow{.id = "fbm", .description = "rolling terrain: octaves of value noise", .generate = fbm},
    ProceduralRow{.id = "ridged", .description = "sharp crests: octaves of folded noise", .generate = ridged},
    ProceduralRow{.id = "bricks", .description = "bevelled bricks in running bond, 4x8 a tile", .generate = bricks},
    ProceduralRow{.id = "spikes", .description = "one raised texel in each 16x16 block", .generate = spikes},
    ProceduralRow{.id = "posts",
                  .description = "a raised texel on each border: beside a clamped map it goes on as a ridge",
                  .generate = posts},
    ProceduralRow{.id = "checker",
                  .description = "texels of 0 and 1 in turn: the worst case of interpolated cones",
                  .generate = checker},
    ProceduralRow{.id = "cliff", .description = "half 0, half 1: a step of full height", .generate = cliff},
    ProceduralRow{.id = "pyramids", .description = "4x4 square pyramids: plane faces", .generate = pyramids},
    ProceduralRow{.id = "plateau", .description = "a flat top with steep sides on flat ground", .generate = plateau},
    ProceduralRow{.id = "constant", .description = "0.5 everywhere", .generate = constant},
    ProceduralRow{
        .id = "ball", .description = "a solid: a ball in the middle of nothing", .generate = ball, .is_solid = true},
    ProceduralRow{.id = "half_torus",
                  .description = "a solid: the upper half of a torus",
                  .generate = half_torus,
                  .is_solid = true},
    ProceduralRow{
        .id = "goblet", .description = "a solid: a figure of revolution, lying", .generate = goblet, .is_solid = true},
    ProceduralRow{
        .id = "grille", .description = "a solid: round bars, 4x4 holes a tile", .generate = grille, .is_solid = true},
    ProceduralRow{.id = "specks",
                  .description = "a solid: single texels, no thickness between them",
                  .generate = specks,
                  .is_solid = true},
    ProceduralRow{.id = "nothing",
                  .description = "a solid whose floor is over its top everywhere: all rays pass",
                  .generate = nothing,
                  .is_solid = true},
};

}  // namespace

std::span<const ProceduralRow> procedurals() { return kProcedurals; }

}  // namespace reliefbench
