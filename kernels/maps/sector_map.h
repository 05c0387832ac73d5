#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "kernels/maps/cone_search.h"

namespace reliefbench {

// Cones by sector: 4, 8 or 16 ratios a texel, each for the rays whose direction in uv is in its sector. The sectors
// begin at the axes, so that each is within one quadrant: what a sector is for is told by signs and comparisons of the
// direction's coordinates, which no rounding can mistake; of 16, by one product, for which the wedges are wider.

inline constexpr std::array<std::string_view, 3> kSectorCounts{"4", "8", "16"};
inline constexpr MapParam kSectors{.id = "sectors",
                                   .description = "sectors of directions, each with a cone of its own",
                                   .max = 2,
                                   .fallback = 0,
                                   .choices = kSectorCounts,
                                   .is_constant = true};

/// Rays that look back where they come from need the cone of the opposite sector, too: from the same texel.
inline constexpr std::array<std::string_view, 2> kRatioCounts{"1", "2"};
inline constexpr MapParam kRatiosATexel{
    .id = "ratios_a_texel",
    .description = "the sector's cone alone, or that of the opposite sector beside it, in texels twice as large",
    .max = 1,
    .fallback = 0,
    .choices = kRatioCounts,
    .is_constant = true,
    .is_spelt_out = false};
inline constexpr std::array<MapParam, 2> kSectorParameters{kSectors, kRatiosATexel};

/// How many sectors a map with these parameters has: 4, 8 or 16.
[[nodiscard]] int sector_count(std::span<const MapValue> parameters);

/// Whether each texel has the opposite sector's ratio beside its own sector's.
[[nodiscard]] bool has_opposite_ratios(std::span<const MapValue> parameters);

/// The tangent of pi / 8, at which a quadrant's half is divided into sectors of 16.
inline constexpr float kSectorTangent = 0.41421356F;

/// Sector k of `count`: bit 0: towards -x, bit 1: -y, bit 2 (from 8 on): nearer to the y axis than to the x axis,
/// bit 3 (of 16): farther from that axis than pi / 8. So the opposite sector is k ^ kOpposite.
[[nodiscard]] Wedge sector_wedge(int k, int count);
inline constexpr int kOpposite = 3;

/// All that a bake makes a layer of.
/// throws: Error(bad_input): its greatest ratio is over 1. Images of a repeated texel then count that are farther away
/// than bakers look
[[nodiscard]] std::vector<MarginedWedge> sector_wedges(const BakeRequest& request);
/// The same of relaxed cones. A ray over a texel, in the sector, goes down through the surface in a cell whose corners
/// are less than one texel per axis from where it does: those may be beside the sector, and always count.
[[nodiscard]] std::vector<MarginedWedge> relaxed_sector_wedges(const BakeRequest& request);

/// The layers of a sector map in one texture, below and beside one another: columns x rows. Each has its heights and
/// ratios within a border of one texel, which repeats the other side, or under clamp this one.
/// throws: Error(bad_input): a side over kMaxSide (image.h)
struct SectorAtlas {
  int columns = 0, rows = 0;
  int width = 0, height = 0;  ///< of all, in texels
  SectorAtlas(int count, int map_width, int map_height);
};

/// Texels beside the point that it is asked for at which a sampler may read an atlas of this side: what its coordinates
/// are rounded by, on the way there and in the sampler, at 2^-24 an operation.
inline constexpr float kAtlasRounding = 0x1p-21F;

/// search_cones of the targets in a wedge. Under clamp the surface goes on beyond the map's border as it is there, and
/// so do the cones. Of points p and q whose offset is in the wedge, at least one of them outside, the nearest points of
/// the map then are at an offset in the wedge's quadrant, and no farther, but maybe not in the wedge. One of them is on
/// the border: p's on one that q is not beyond, or q's on one that p is not beyond. So owners on the borders behind
/// them see the whole quadrant, and targets on the borders before them are seen in all of it. Of a wedge round an axis
/// it is the half-plane, and the borders across that axis: along the others an offset only comes nearer to the axis.
/// search: without views.
/// candidates: the heights that count as targets. width, height: texels along one uv
[[nodiscard]] std::vector<float> search_wedge(const ConeSearch& search, const Heightfield& candidates, int width,
                                              int height, const Wedge& wedge, double margin);

/// certified_cones of what a wedge has of the surface.
[[nodiscard]] std::vector<float> certified_cones(const BakeRequest& request, const std::optional<Wedge>& wedge);

/// What a bake makes of a wedge, by its correction.
[[nodiscard]] std::vector<float> wedge_cones(const BakeRequest& request, const MarginedWedge& margined);

/// The exact conservative ratios of every sector, a layer of width x height after the other.
/// throws: Error(bad_input) if either side is under 2 texels, or the row has no such correction
[[nodiscard]] std::vector<float> bake_sector(const BakeRequest& request);

/// The same of relaxed cones, after bake_relaxed.
[[nodiscard]] std::vector<float> bake_sector_relaxed(const BakeRequest& request);

}  // namespace reliefbench
