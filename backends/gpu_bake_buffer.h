#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gpu_bake.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/fine_grid.h"

namespace reliefbench {

// What a baker's shaders are told, but for the heights: bake_common.glsl.

inline constexpr int kGroupSide = 8;  // texels

/// Which texel of a node the quick bakers measure the distance to.
enum class BakeFootpoint : std::int32_t {
  nearest,
  unvisited,
  published,  ///< as unvisited, but for two corners
  centre
};

/// Texels or packets of the first grid of bake_ray.glsl from one to the next.
inline constexpr int kWidestStride = 8;

/// In place of a turn: texels begin with the least of their limits.
inline constexpr int kBeforeAllTurns = -1;

/// In place of the ratio of a texel whose search the device did not carry to its end.
inline constexpr float kCutShort = -1;

/// What a search goes over: a map, or a finer grid of its surface.
struct BakeGrid {
  int width = 0;  ///< points
  int height = 0;
  int uv_width = 0;  ///< points along one uv: a finer grid under clamp has less of them
  int uv_height = 0;
  Subdivision by{};     ///< points a texel of the map
  float max_ratio = 1;  ///< what it searches up to
  float guard = 0;      ///< rise_guard
  [[nodiscard]] std::size_t points() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};
[[nodiscard]] BakeGrid map_grid(const BakeRequest& request);
/// For the lower bounds of cones there.
[[nodiscard]] BakeGrid finer_grid(const BakeRequest& request, Subdivision by);

/// What an invocation makes.
enum class BakeUnit {
  texels,
  packets,  ///< 2 x 2 texels
  groups    ///< with all of its workgroup, a texel
};

/// A cone for every texel, or a layer of them for every wedge, from one pyramid or several.
struct BakeSearch {
  std::string_view shader;  ///< name of the .comp file
  bool quadrants = false;   ///< one pyramid each, of the texels that bound a relaxed cone in it
  BakeFootpoint footpoint = BakeFootpoint::nearest;
  BakeUnit unit = BakeUnit::texels;
  bool walks_rays = false;  ///< over what bake_corners.comp makes, grid by grid: bake_ray.glsl
  bool goes_on = false;     ///< in a next pass, where a device would not let it come to its end
  std::vector<MarginedWedge> (*wedges)(const BakeRequest& request) = nullptr;  ///< null: all directions have one cone
};

struct alignas(16) BakeLevel {
  std::int32_t first = 0;   ///< node
  std::int32_t stride = 0;  ///< nodes from row to row
};
inline constexpr std::size_t kMostLevels = 20;  ///< of points: 2^20 along an axis
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
[[nodiscard]] BakeLevels quad_levels(int width, int height);
/// Nodes of such a level along a side of the map.
[[nodiscard]] constexpr int nodes_at(int side, int level) { return ((side - 1) >> level) + 1; }

/// Of a mip chain, from level 0 on.
[[nodiscard]] BakeLevels chain_levels(int width, int height);

/// Of shapes, from level 0 on: bake_shape.glsl.
[[nodiscard]] BakeLevels shape_levels(const Heightfield& heights, Wrap wrap);
inline constexpr std::size_t kShapeBytes = 6 * sizeof(double);

/// Of where a search for a packet of rays is: bake_relaxed_po07_packets.comp.
inline constexpr std::size_t kSearchBytes = 8 * sizeof(std::int32_t);

/// Constants that the shaders share with the C++ side, as GLSL: bake_contract.glsl.
[[nodiscard]] std::string bake_contract(BakeDevice device, BakeFootpoint footpoint);

/// Bytes of the Bake block of a search on quads.
[[nodiscard]] std::vector<std::byte> search_block(const BakeRequest& request, const BakeGrid& grid,
                                                  const BakeSearch& search, const BakeLevels& levels, int layers);
/// Of a mip chain: bake_levels.comp.
[[nodiscard]] std::vector<std::byte> chain_block(const BakeRequest& request, const BakeLevels& levels, int layers,
                                                 bool is_of_cells);
/// And of the search for radii, on shapes.
[[nodiscard]] std::vector<std::byte> radius_block(const BakeRequest& request, const BakeLevels& levels);

}  // namespace reliefbench
