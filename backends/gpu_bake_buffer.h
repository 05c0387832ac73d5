#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gpu_bake.h"
#include "backends/gpu_bake_wedge.h"
#include "kernels/maps/cone_map.h"

namespace reliefbench {

// What a baker's shaders are told, but for the heights: bake_common.glsl.

inline constexpr int kGroupSide = 8;  // texels

/// Which texel of a node the quick bakers measure the distance to.
enum class BakeFootpoint : std::int32_t { nearest, unvisited, centre };

/// In place of the ratio of a texel whose search the device did not carry to its end.
inline constexpr float kCutShort = -1;

/// A cone for every texel, or a layer of them for every wedge, from one pyramid or several.
struct BakeSearch {
  std::string_view shader;  ///< name of the .comp file
  bool quadrants = false;   ///< one pyramid each, of the texels that bound a relaxed cone in it
  BakeFootpoint footpoint = BakeFootpoint::nearest;
  bool group_a_texel = false;  ///< a workgroup for each texel; else for 8 x 8
  std::vector<MarginedWedge> (*wedges)(const BakeRequest& request) = nullptr;  ///< null: all directions have one cone
};

struct BakeLevel {
  std::int32_t first;   ///< node
  std::int32_t stride;  ///< nodes from row to row
};
/// The levels of a pyramid, the finest first, and how many nodes they have.
struct BakeLevels {
  std::vector<BakeLevel> levels;
  int nodes = 0;
  void add(int width, int height) {
    levels.push_back({.first = nodes, .stride = width});
    nodes += width * height;
  }
};
/// Of quads, from level 1 on: bake_pyramid.glsl.
[[nodiscard]] BakeLevels quad_levels(const Heightfield& heights);
inline constexpr std::size_t kQuadBytes = 4 * sizeof(float);
/// Nodes of such a level along a side of the map.
[[nodiscard]] constexpr int nodes_at(int side, int level) { return ((side - 1) >> level) + 1; }

/// Of shapes, from level 0 on: bake_shape.glsl.
[[nodiscard]] BakeLevels shape_levels(const Heightfield& heights, Wrap wrap);
inline constexpr std::size_t kShapeBytes = 6 * sizeof(double);

/// Constants that the shaders share with the C++ side, as GLSL: bake_contract.glsl.
[[nodiscard]] std::string bake_contract(BakeNumbers numbers);

/// Bytes of the Bake buffer of a search on quads.
[[nodiscard]] std::vector<std::byte> search_buffer(const BakeRequest& request, const BakeSearch& search,
                                                   const BakeLevels& levels, int layers);
/// And of the search for radii, on shapes.
[[nodiscard]] std::vector<std::byte> radius_buffer(const BakeRequest& request, const BakeLevels& levels);

}  // namespace reliefbench
