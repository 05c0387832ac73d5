// Cones of cells, against their definition and against the surface itself.
#include "kernels/maps/cell_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/error.h"
#include "kernels/maps/map_verify.h"
#include "tests/cone_requests.h"
#include "tests/slow_cone_map.h"

namespace reliefbench {
namespace {

float top_of(const Heightfield& heights, Wrap wrap, int i, int j) {
  float top = 0;
  for (const int x : {i, i + 1})
    for (const int y : {j, j + 1})
      top = std::max(top, heights.at(wrapped(x, heights.width, wrap), wrapped(y, heights.height, wrap)));
  return top;
}

/// Over all texels of all images that are near enough: those before the outer corner at the distances of `safe`, those
/// of the inner row and column at their own.
float slow_cell_cone(const Heightfield& heights, Wrap wrap, int i, int j, int quarter) {
  const bool is_left = (quarter & 1) != 0;
  const bool is_down = (quarter & 2) != 0;
  const auto top = static_cast<double>(top_of(heights, wrap, i, j));
  const SlowMetric safe(heights, Correction::safe);
  const SlowMetric whole(heights, Correction::none);
  double least = std::numeric_limits<double>::infinity();
  const int images = wrap == Wrap::repeat ? 2 : 0;
  for (int y = -images * heights.height; y < (images + 1) * heights.height; ++y) {
    for (int x = -images * heights.width; x < (images + 1) * heights.width; ++x) {
      const int dx = is_left ? i - x : x - i - 1;
      const int dy = is_down ? j - y : y - j - 1;
      const double rise =
          static_cast<double>(heights.at(wrapped(x, heights.width, wrap), wrapped(y, heights.height, wrap))) - top;
      if (rise <= 0) continue;
      if (dx >= 0 && dy >= 0) least = std::min(least, safe.distance2(dx, dy) / (rise * rise));
      if (dx > 0 && dy == -1) least = std::min(least, whole.distance2(dx, 0) / (rise * rise));
      if (dy > 0 && dx == -1) least = std::min(least, whole.distance2(0, dy) / (rise * rise));
    }
  }
  return std::min(1.0F, slow_ratio(least, safe.unit.tile));
}

/// Under clamp the last row and column of cells is read by no ray.
bool is_read(const Heightfield& heights, Wrap wrap, int i, int j) {
  return wrap == Wrap::repeat || (i < heights.width - 1 && j < heights.height - 1);
}

template <typename Body>
void for_each_map(std::initializer_list<MapSize> sizes, const Body& body) {
  for (const ConeTestMap& map : kConeTestMaps)
    for (const auto& [width, height] : sizes)
      for (const Wrap wrap : kWraps) {
        const Heightfield heights = map.make(width, height);
        SCOPED_TRACE(label(map.id, heights, wrap));
        body(heights, wrap);
      }
}

TEST(CellMap, HasTheBitsOfAllPairs) {
  for_each_map({{2, 2}, {5, 3}, {3, 9}, {11, 11}}, [](const Heightfield& heights, Wrap wrap) {
    const std::vector<float> cones = bake_cell({.heights = heights, .wrap = wrap, .threads = 1});
    ASSERT_EQ(cones.size(), kQuarters * heights.texels.size());
    for (int k = 0; k < kQuarters; ++k)
      for (int j = 0; j < heights.height; ++j)
        for (int i = 0; i < heights.width; ++i)
          if (is_read(heights, wrap, i, j)) {
            ASSERT_EQ(cones[static_cast<std::size_t>(k) * heights.texels.size() + heights.index(i, j)],
                      slow_cell_cone(heights, wrap, i, j, k))
                << k << " " << i << " " << j;
          }
  });
}

// The theorem, without its proof: the cone of the nearest point over the cell holds no point of a fine grid on the
// surface, beside the map neither.
TEST(CellMap, HoldsNoPointOfTheSurface) {
  constexpr double kStep = 0.125;
  for_each_map({{7, 7}, {6, 4}, {3, 8}}, [](const Heightfield& heights, Wrap wrap) {
    const std::vector<float> cones = bake_cell({.heights = heights, .wrap = wrap, .threads = 1});
    double nearest = 0;
    for (int k = 0; k < kQuarters; ++k) {
      const double to_x = (k & 1) == 0 ? 1 : -1;
      const double to_y = (k & 2) == 0 ? 1 : -1;
      for (int j = 0; j < heights.height; ++j) {
        for (int i = 0; i < heights.width; ++i) {
          if (!is_read(heights, wrap, i, j)) continue;
          const auto ratio =
              static_cast<double>(cones[static_cast<std::size_t>(k) * heights.texels.size() + heights.index(i, j)]);
          const auto top = static_cast<double>(top_of(heights, wrap, i, j));
          const double x = to_x > 0 ? i : i + 1;
          const double y = to_y > 0 ? j : j + 1;
          for (double along_y = 0; along_y <= heights.height + 1; along_y += kStep) {
            for (double along_x = 0; along_x <= heights.width + 1; along_x += kStep) {
              const double rise = slow_surface(heights, wrap, x + to_x * along_x, y + to_y * along_y) - top;
              const double away =
                  std::hypot(std::max(along_x - 1, 0.0) / heights.width, std::max(along_y - 1, 0.0) / heights.height);
              ASSERT_LE(rise * ratio, away + 1e-9) << k << " " << i << " " << j << " " << along_x << " " << along_y;
              if (away > 0 && ratio < 1) nearest = std::max(nearest, rise * ratio / away);
            }
          }
        }
      }
    }
    EXPECT_TRUE(nearest == 0 || nearest > 0.5);  // the cones are not narrower than they must be by much
  });
}

MapVerdict stored_and_verified(const Heightfield& heights, Wrap wrap, std::string_view format_id,
                               std::string_view encoding_id, float wider = 1) {
  const Format& format = find_format(format_id);
  const Encoding& encoding = find_encoding(encoding_id);
  const MapRow& map = find_map(MapKind::cell);
  const Heightfield quantised = quantise_heights(heights, format.type);
  std::vector<float> cones = bake_cell({.heights = quantised, .wrap = wrap, .threads = 1});
  for (float& ratio : cones) ratio = std::min(1.0F, wider * ratio);
  const MapTextures textures =
      pack_map({.map = map, .heights = quantised, .values = cones, .wrap = wrap}, format, encoding);
  return verify_map(
      {.map = map, .textures = textures, .format = format, .encoding = encoding, .wrap = wrap, .threads = 1});
}

TEST(CellMap, IsProvedAsItIsStored) {
  for (const auto make : {fbm_map, noise_map, checker_map, cliff_map})
    for (const Heightfield& heights : {make(12, 12), make(15, 7)})
      for (const Wrap wrap : kWraps) {
        for (const auto& [format, encoding] : {std::pair("rg8", "sqrt"), std::pair("rg16", "h_tan"),
                                               std::pair("rg16", "atan"), std::pair("rg16f", "ratio")}) {
          const MapVerdict verdict = stored_and_verified(heights, wrap, format, encoding);
          EXPECT_EQ(verdict.cells.cells, kQuarters * heights.width * heights.height);
          EXPECT_EQ(verdict.cells.proved, verdict.cells.cells) << format << " " << encoding;
          EXPECT_FALSE(verdict.broken || verdict.undecided);
        }
      }
}

TEST(CellMap, TooWideConesAreFound) {
  EXPECT_TRUE(stored_and_verified(noise_map(12, 12), Wrap::repeat, "rg16", "ratio", 1.5F).broken);
  // A little wider than is proved, and no texel in it.
  const MapVerdict little = stored_and_verified(fbm_map(12, 12), Wrap::repeat, "rg32f", "ratio", 1.001F);
  EXPECT_GT(little.cells.undecided, 0);
}

TEST(CellMap, IsRefusedWhereItsImagesWouldBeTooFar) {
  const Heightfield map = noise_map(4, 4);
  EXPECT_THROW((void)bake_cell({.heights = map, .max_ratio = kUnboundedRatio}), Error);
}

}  // namespace
}  // namespace reliefbench
