#pragma once
#include <vector>

#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// One tile's side in the distances' metric, in which the whole range of heights is 1. Twin of TILE_SIDE in
/// distance.glsl. Of 1, 4 and 10 it takes the fewest steps over the view presets together (rocks, 0.1 deep).
inline constexpr double kTileSide = 4;

inline constexpr MapParam kDistanceSlices{.id = "distance_slices",
                                          .description = "voxels from the bottom plate to the top",
                                          .min = 4,
                                          .max = 256,
                                          .fallback = 32,
                                          .is_constant = true};

/// The slices in one texture, row by row, from the bottom one on: of all grids that hold them the one of fewest texels,
/// and of those the one of the shortest longer side.
struct VolumeAtlas {
  int columns = 0, rows = 0;  ///< of slices; 0: no texture of at most kMaxSide (image.h) a side holds them
  VolumeAtlas(int slices, int map_width, int map_height);
};

/// Distances to the relief [DON05], made conservative: width x height x distance_slices voxels, the bottom slice first.
/// Voxel (i, j, k) is texel (i, j) times heights k to k + 1 of distance_slices. Its value is at most the distance from
/// any of its points to the solid under the bilinear surface, so that a nearest fetch never steps too far; 0 where the
/// voxel meets the solid. Under clamp a voxel of the edge answers for the space beyond it too.
/// Metric: Euclidean in (kTileSide u, kTileSide v, height); the surface is at most 1 below, so values are in [0, 1].
/// The solid over a texel is taken as a box up to the surface's exact maximum over it. Exact for such boxes, but for a
/// guard: 1e-14 off the square (the transform's rounding, 2e-15 at worst), then 2^-20 off the distance (a shader's
/// arithmetic, of a few ulp), rounded down. A shader's position is as exact as its coordinates, 2^-24 of them.
/// throws: Error(bad_input) if either side is under 2 texels, distance_slices are out of range, or there is no
///         VolumeAtlas
[[nodiscard]] std::vector<float> bake_distance(const BakeRequest& request);

}  // namespace reliefbench
