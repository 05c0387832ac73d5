#pragma once
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kernels/image/heightmap.h"
#include "kernels/judge/reference.h"

namespace reliefbench {

using SolidRandom = std::mt19937;

inline double between(SolidRandom& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline int below(SolidRandom& random, int count) { return std::uniform_int_distribution<int>(0, count - 1)(random); }

/// height: of a surface at a texel, `is_floor` saying which
template <typename Height>
Heightfield made_solid(int width, int height, const Height& surface) {
  Heightfield solid{.width = width, .height = height, .texels = {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      solid.texels.push_back(static_cast<float>(surface(x, y, false)));
      solid.floors.push_back(static_cast<float>(surface(x, y, true)));
    }
  return solid;
}

inline std::vector<std::string> solid_names() {
  std::vector<std::string> names;
  for (const ProceduralRow& row : procedurals())
    if (row.is_solid) names.emplace_back(row.id);
  return names;
}

struct SolidCase {
  std::string name;
  Heightfield solid;
};
/// Every solid that can be made, small, and what is hard about solids.
inline std::vector<SolidCase> solid_cases(SolidRandom& random) {
  std::vector<SolidCase> cases;
  for (const std::string& name : solid_names())
    for (const int side : {2, 9, 32})
      cases.push_back({name, load_heightmap({.source = name, .width = side, .height = side + 3})});
  cases.push_back({"noise", made_solid(7, 9, [&](int, int, bool) { return between(random, 0, 1); })});
  cases.push_back({"thin", made_solid(16, 16, [&](int x, int y, bool is_floor) {
                     return 0.5 + 0.3 * std::sin(x + 0.3 * y) - (is_floor ? between(random, -0.02, 0.05) : 0);
                   })});
  cases.push_back({"steps", made_solid(8, 5, [&](int, int, bool) { return below(random, 5) / 4.0; })});
  cases.push_back({"full", made_solid(4, 4, [](int, int, bool is_floor) { return is_floor ? 0 : 1; })});
  cases.push_back({"one_texel", made_solid(9, 9, [](int x, int y, bool is_floor) {
                     const bool is_it = x == 4 && y == 4;
                     return is_floor == is_it ? 0.25 : 0.75;
                   })});
  cases.push_back({"sheet", made_solid(6, 6, [](int x, int, bool) { return 0.1 * x + 0.2; })});
  return cases;
}

/// Rays from anywhere, and those that rounding may lead astray: straight down, along edges, from texels, far away.
inline TextureRay some_ray(const Heightfield& solid, SolidRandom& random) {
  const auto centre = [&](int side) { return static_cast<float>((below(random, 3 * side) - side + 0.5) / side); };
  const auto anywhere = [&] { return static_cast<float>(between(random, -1.5, 2.5)); };
  const auto slope = [&] {
    const double length = std::exp(between(random, std::log(0.01), std::log(30.0)));
    return static_cast<float>(below(random, 2) == 0 ? length : -length);
  };
  switch (below(random, 6)) {
    case 0:
      return {anywhere(), anywhere(), 0, 0};  // straight down
    case 1:
      return {centre(solid.width), anywhere(), 0, slope()};  // along a cell's edge
    case 2:
      return {centre(solid.width), centre(solid.height), slope(), slope()};  // from a texel
    case 3:
      return {1000 * anywhere(), anywhere(), slope(), 0};
    default:
      return {anywhere(), anywhere(), slope(), slope()};
  }
}

}  // namespace reliefbench
