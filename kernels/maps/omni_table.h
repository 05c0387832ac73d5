#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/judge/reference.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// A tile is as many times as wide as the relief is deep, where the directions of a table are evenly spread: they are
/// angles of rays through a relief that is 1 / kOmniTile deep. Reliefs of any depth are read from the same table.
inline constexpr float kOmniTile = 10;

inline constexpr std::array<std::string_view, 2> kOmniOrders{"xyab", "abxy"};
inline constexpr std::array<std::string_view, 2> kOmniDirections{"octahedral", "spherical"};
/// What a table has for itself, in the order of OmniTable's members. The shaders have them as constants.
inline constexpr std::array kOmniParams{
    MapParam{
        .id = "omni_x", .description = "positions along u", .min = 2, .max = 2048, .fallback = 32, .is_constant = true},
    MapParam{
        .id = "omni_y", .description = "positions along v", .min = 2, .max = 2048, .fallback = 32, .is_constant = true},
    MapParam{.id = "omni_a",
             .description = "directions along their first coordinate",
             .min = 2,
             .max = 256,
             .fallback = 16,
             .is_constant = true},
    MapParam{.id = "omni_b",
             .description = "directions along their second coordinate",
             .min = 2,
             .max = 256,
             .fallback = 16,
             .is_constant = true},
    MapParam{.id = "omni_order",
             .description = "what lies together in the texture: the directions of a position (xyab), or the positions "
                            "of a direction (abxy)",
             .min = 0,
             .max = 1,
             .fallback = 1,
             .choices = kOmniOrders,
             .is_constant = true},
    MapParam{.id = "omni_directions",
             .description = "coordinates of a direction: a folded octahedron, or the paper's two angles, with poles on "
                            "the horizon",
             .min = 0,
             .max = 1,
             .fallback = 0,
             .choices = kOmniDirections,
             .is_constant = true}};

/// How the results of a x b rays from each of x x y positions lie in one texture. Position i of n is at (i + 0.5) / n
/// of a tile, direction k of n at (k + 0.5) / n of its coordinate.
struct OmniTable {
  int x, y, a, b;
  bool is_by_direction;  ///< abxy
  bool is_octahedral;

  /// parameters: of kOmniParams, in any order; one that is absent has its default
  explicit OmniTable(std::span<const MapValue> parameters);

  struct Node {
    int x, y, a, b;
  };
  [[nodiscard]] int width() const { return x * a; }   ///< texels
  [[nodiscard]] int height() const { return y * b; }  ///< texels
  [[nodiscard]] Node node_at(int column, int row) const;
  /// The ray of a node. The directions' coordinates, both in (0, 1), of a ray whose slope is (s, t) / kOmniTile:
  /// spherical: [RTM] 5.9, a = acos(s / sqrt(s^2 + 1)) / pi, b = acos(t / sqrt(s^2 + t^2 + 1)) / pi
  /// octahedral: p = (s, t) / (|s| + |t| + 1), a, b = (1 + p_s + p_t, 1 + p_s - p_t) / 2; the horizon is the square's
  /// border, so that neighbours are neighbours at any azimuth
  /// Of n x n, the nearest one is at most 2.5 / n radians away (spherical: 2.3 / n, but crowded at the poles). The
  /// octahedral ray nearest to the horizon has a slope of (n - 1) / kOmniTile in all.
  [[nodiscard]] TextureRay ray(const Node& node) const;
};

/// Why there is no table of such sizes, or "" if there is one.
[[nodiscard]] std::string omni_refusal(std::span<const MapValue> parameters);

/// The exact first hit of every node's ray, t in [0, 1] of the way from the top plate to the bottom one; the texture's
/// rows, from the top. Rounded to float, then to the nearest code of the format: neither side is the safe one.
/// throws: Error(bad_input): a side under 2 texels, parameters out of range, omni_refusal() has a reason
/// source: [RTM] 5.9 ("omni-directional displacement")
[[nodiscard]] std::vector<float> bake_omni(const BakeRequest& request);

}  // namespace reliefbench
