// Cones by sector, against their definitions.
#include "kernels/maps/sector_map.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "kernels/base/error.h"
#include "kernels/maps/map_verify.h"
#include "tests/cone_requests.h"
#include "tests/slow_cone_map.h"

namespace reliefbench {
namespace {

constexpr std::array kCounts{4, 8, 16};

std::vector<MapValue> sectors_of(int count) { return {{.param = kSectors.id, .value = count / 8}}; }

/// The sector of a direction, by its angle.
int sector_of_angle(double u, double v, int count) {
  const double folded = std::atan2(std::abs(v), std::abs(u));
  int sector = (u < 0 ? 1 : 0) + (v < 0 ? 2 : 0);
  const bool is_steep = std::abs(v) > std::abs(u);
  if (count >= 8 && is_steep) sector += 4;
  if (count == 16 && (is_steep ? std::numbers::pi / 2 - folded : folded) > std::numbers::pi / 8) sector += 8;
  return sector;
}

struct Point {
  double x, y;
};

/// What a polygon has on the left of a line through the origin, towards (x, y).
std::vector<Point> left_part(const std::vector<Point>& polygon, double x, double y) {
  std::vector<Point> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point a = polygon[i];
    const Point b = polygon[(i + 1) % polygon.size()];
    const double of_a = x * a.y - y * a.x;
    const double of_b = x * b.y - y * b.x;
    if (of_a >= 0) part.push_back(a);
    if ((of_a < 0) != (of_b < 0)) {
      const double t = of_a / (of_a - of_b);
      part.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
  }
  return part;
}

double area(const std::vector<Point>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point a = polygon[i];
    const Point b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return twice / 2;
}

/// The angles in uv at which a sector begins and ends.
std::array<double, 2> ends_of(int k, int count) {
  const double size = 2 * std::numbers::pi / count;
  int part = 0;  // of the first quadrant, from the x axis on
  if (count == 8) part = k / 4;
  if (count == 16) part = k / 4 == 0 ? 0 : (k / 4 == 2 ? 1 : (k / 4 == 3 ? 2 : 3));
  double from = part * size;
  double to = from + size;
  if ((k & 1) != 0) std::tie(from, to) = std::pair(std::numbers::pi - to, std::numbers::pi - from);
  if ((k & 2) != 0) std::tie(from, to) = std::pair(-to, -from);
  return {from, to};
}

/// Whether an offset in texels counts in a sector; `safe`: any less than one texel per axis from it.
bool counts_in(int k, int count, const BakeRequest& request, double dx, double dy) {
  const auto [from, to] = ends_of(k, count);
  const double width = request.heights.width;
  const double height = request.heights.height;
  const Point first{std::cos(from) * width, std::sin(from) * height};
  const Point last{std::cos(to) * width, std::sin(to) * height};
  if (request.correction != Correction::safe) {
    constexpr double kEdge = 1e-9;
    return first.x * dy - first.y * dx >= -kEdge && last.y * dx - last.x * dy >= -kEdge &&
           (dx * std::cos((from + to) / 2) * width + dy * std::sin((from + to) / 2) * height) >= -kEdge;
  }
  std::vector<Point> square{{dx - 1, dy - 1}, {dx + 1, dy - 1}, {dx + 1, dy + 1}, {dx - 1, dy + 1}};
  square = left_part(square, first.x, first.y);
  square = left_part(square, -last.x, -last.y);
  return area(square) > 1e-9;
}

std::vector<float> slow_sectors(const BakeRequest& request, int count) {
  const bool is_clamped = request.wrap == Wrap::clamp;
  const int width = request.heights.width;
  const int height = request.heights.height;
  std::vector<float> all;
  for (int k = 0; k < count; ++k) {
    const int x = (k & 1) == 0 ? 1 : -1;
    const int y = (k & 2) == 0 ? 1 : -1;
    const auto ratios = slow_view_ratios(request, 2, [&](int i, int j, double dx, double dy) {
      if (counts_in(k, count, request, dx, dy)) return true;
      const double from_x = i - dx;
      const double from_y = j - dy;
      const bool leaves = from_x == (x > 0 ? 0 : width - 1) || from_y == (y > 0 ? 0 : height - 1) ||
                          i == (x > 0 ? width - 1 : 0) || j == (y > 0 ? height - 1 : 0);
      return is_clamped && leaves && dx * x >= 0 && dy * y >= 0;
    });
    const auto layer = corrected(ratios, request);
    all.insert(all.end(), layer.begin(), layer.end());
  }
  return all;
}

TEST(SectorMap, HasTheBitsOfAllPairs) {
  for_each_request({{2, 2}, {5, 3}, {3, 9}, {11, 11}}, [](const BakeRequest& request) {
    for (const int count : kCounts) {
      BakeRequest of_count = request;
      of_count.parameters = sectors_of(count);
      EXPECT_EQ(bake_sector(of_count), slow_sectors(of_count, count)) << count;
    }
  });
}

RC_GTEST_PROP(SectorMapProperty, HasTheBitsOfAllPairs, ()) {
  const Heightfield heights = random_map(10);
  BakeRequest request = random_request(heights);
  request.max_ratio = 1;
  const int count = *rc::gen::element(4, 8, 16);
  request.parameters = sectors_of(count);
  RC_ASSERT(bake_sector(request) == slow_sectors(request, count));
}

TEST(SectorMap, SectorsAreWithinTheirWedgesWhateverTheFloats) {
  for (const int count : kCounts) {
    for (int i = 0; i < 40000; ++i) {
      const double angle =
          i < 20000 ? i * 1e-3 : (i % 16) * std::numbers::pi / 8 + static_cast<double>(i - 30000) * 1e-11;
      const auto u = static_cast<float>(std::cos(angle));
      const auto v = static_cast<float>(std::sin(angle));
      // As the shader has it, in float.
      const float steep_u = std::abs(u);
      const float steep_v = std::abs(v);
      int sector = (u < 0 ? 1 : 0) + (v < 0 ? 2 : 0);
      if (count >= 8 && steep_v > steep_u) sector += 4;
      if (count == 16 && std::min(steep_u, steep_v) > kSectorTangent * std::max(steep_u, steep_v)) sector += 8;
      for (const ConeView::Normal& n : sector_wedge(sector, count).normals)
        ASSERT_GE(n.x * static_cast<double>(u) + n.y * static_cast<double>(v), 0) << angle << " " << count;
      const Wedge opposite = sector_wedge(sector ^ 3, count);
      for (const ConeView::Normal& n : opposite.normals)
        ASSERT_LE(n.x * static_cast<double>(u) + n.y * static_cast<double>(v), 0) << angle << " " << count;
    }
  }
}

int surface_points_in_layers(const Heightfield& map, const std::vector<float>& layers, int count, Wrap wrap) {
  std::vector<Heightfield> cones(static_cast<std::size_t>(count), map);
  for (std::size_t i = 0; i < layers.size(); ++i)
    cones[i / map.texels.size()].texels[i % map.texels.size()] = layers[i];
  return surface_points_in_sectors(map, cones, wrap,
                                   [&](double du, double dv) { return sector_of_angle(du, dv, count); });
}

TEST(SectorMap, SafeConesNeverMeetTheInterpolatedSurface) {
  for (const ConeTestMap& map : kConeTestMaps)
    for (const auto& [width, height] : {MapSize{8, 8}, MapSize{9, 7}, MapSize{4, 10}}) {
      const Heightfield heights = map.make(width, height);
      for (const Wrap wrap : kWraps)
        for (const int count : kCounts)
          for (const Correction correction : {Correction::safe, Correction::certified}) {
            const auto layers = bake_sector({.heights = heights,
                                             .wrap = wrap,
                                             .correction = correction,
                                             .parameters = sectors_of(count),
                                             .threads = 1});
            EXPECT_EQ(surface_points_in_layers(heights, layers, count, wrap), 0)
                << label(map.id, heights, wrap, correction) << " " << count;
          }
    }
  // That this can fail: cones of the texels alone are too wide between them.
  const Heightfield noise = noise_map(8, 8);
  for (const int count : kCounts) {
    const auto plain = bake_sector({.heights = noise, .parameters = sectors_of(count), .threads = 1});
    EXPECT_GT(surface_points_in_layers(noise, plain, count, Wrap::repeat), 0);
  }
}

// Beside a clamped map the texels of its border go on as ridges: rays meet them, and leave from there, at offsets that
// no texel of the map has.
TEST(SectorMap, SafeConesSeeWhatTheBorderGoesOnAs) {
  const Heightfield spike = make_map(12, 12, [](int x, int y) { return x == 11 && y == 8 ? 1.0F : 0.0F; });
  const BakeRequest request{.heights = spike, .wrap = Wrap::clamp, .correction = Correction::safe, .threads = 1};
  const ConeSearch search{
      .heights = spike, .wrap = Wrap::clamp, .metric = cone_metric(12, 12, Correction::safe), .threads = 1};
  for (const int count : kCounts) {
    BakeRequest of_count = request;
    of_count.parameters = sectors_of(count);
    EXPECT_EQ(surface_points_in_layers(spike, bake_sector(of_count), count, Wrap::clamp), 0) << count;
    // That this can fail: as if there were nothing beside the map. A quadrant has it all as it is.
    std::vector<float> unaware;
    for (int k = 0; k < count; ++k) {
      ConeSearch seen = search;
      const Wedge wedge = sector_wedge(k, count);
      seen.views = {wedge_view(spike, 12, 12, wedge, wedge.safe_margin)};
      const auto layer = corrected(search_cones(seen), request);
      unaware.insert(unaware.end(), layer.begin(), layer.end());
    }
    EXPECT_EQ(surface_points_in_layers(spike, unaware, count, Wrap::clamp) > 0, count > 4) << count;
  }
}

TEST(SectorMap, MoreSectorsAreWiderAndTheNarrowestIsTheConservativeCone) {
  for (const ConeTestMap& map : kConeTestMaps) {
    const Heightfield heights = map.make(40, 33);
    const BakeRequest request{.heights = heights, .threads = 2};
    const auto conservative = bake_conservative(request);
    double last = 0;
    for (const int count : kCounts) {
      BakeRequest of_count = request;
      of_count.parameters = sectors_of(count);
      const auto layers = bake_sector(of_count);
      std::vector<float> least(layers.begin(), layers.begin() + static_cast<std::ptrdiff_t>(conservative.size()));
      double sum = 0;
      for (std::size_t i = 0; i < layers.size(); ++i) {
        float& narrowest = least[i % least.size()];
        narrowest = std::min(narrowest, layers[i]);
        sum += layers[i];
      }
      EXPECT_EQ(least, conservative) << map.id << " " << count;
      EXPECT_GE(sum / count, last) << map.id << " " << count;
      last = sum / count;
    }
  }
}

TEST(SectorMap, IsRefusedWhereItsImagesWouldBeTooFar) {
  const Heightfield map = noise_map(4, 4);
  EXPECT_THROW((void)bake_sector({.heights = map, .max_ratio = kUnboundedRatio}), Error);
}

MapVerdict baked_and_verified(MapKind kind, const Heightfield& heights, Correction correction, Wrap wrap, int count,
                              std::string_view format = "rg16") {
  const MapRow& map = find_map(kind);
  const Format& stored = find_format(format);
  const Heightfield quantised = quantise_heights(heights, stored.type);
  const std::vector<MapValue> parameters = sectors_of(count);
  const std::vector<float> values =
      map.bake({.heights = quantised, .wrap = wrap, .correction = correction, .parameters = parameters, .threads = 1});
  const MapTextures textures =
      pack_map({.map = map, .heights = quantised, .values = values, .wrap = wrap, .parameters = parameters}, stored,
               find_encoding("sqrt"));
  return verify_map({.map = map,
                     .textures = textures,
                     .format = stored,
                     .encoding = find_encoding("sqrt"),
                     .correction = correction,
                     .wrap = wrap,
                     .rays = 1 << 13,
                     .threads = 1,
                     .parameters = parameters});
}

TEST(SectorMap, SafeOnesAreProvedAsTheyAreStored) {
  for (const auto make : {fbm_map, noise_map, checker_map, cliff_map})
    for (const Heightfield& heights : {make(12, 12), make(15, 7)})
      for (const Wrap wrap : kWraps)
        for (const int count : kCounts)
          for (const auto& [correction, format] :
               {std::pair(Correction::safe, "rg8"), std::pair(Correction::certified, "rg16f")}) {
            const MapVerdict verdict = baked_and_verified(MapKind::sector, heights, correction, wrap, count, format);
            EXPECT_EQ(verdict.texels, count * heights.width * heights.height);
            EXPECT_EQ(verdict.texels_too_wide, 0);
            EXPECT_EQ(verdict.cells.proved, verdict.cells.cells) << count << " " << correction_id(correction);
            EXPECT_FALSE(verdict.broken || verdict.undecided);
          }
  // That it can fail.
  EXPECT_TRUE(baked_and_verified(MapKind::sector, noise_map(12, 12), Correction::none, Wrap::repeat, 8).broken);
}

TEST(SectorMap, RelaxedOnesAreCrossedOnce) {
  for (const auto make : {fbm_map, noise_map, checker_map, cliff_map})
    for (const Wrap wrap : kWraps)
      for (const int count : kCounts) {
        const MapVerdict verdict =
            baked_and_verified(MapKind::sector_relaxed, make(24, 20), Correction::safe, wrap, count);
        EXPECT_GT(verdict.rays.rays, 1000);
        EXPECT_EQ(verdict.texels_too_wide, 0);
        EXPECT_EQ(verdict.rays.crossing_twice, 0) << count;
      }
}

TEST(SectorMap, AnAtlasThatNoTextureHoldsIsRefused) {
  EXPECT_EQ(SectorAtlas(8, 4094, 16).width, kMaxSide);
  try {
    static_cast<void>(SectorAtlas(8, 4096, 16));
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "8 layers of 4096x16 texels are a texture of 16392x36, expected at most 16384 a side");
  }
}

std::vector<MapValue> paired_sectors_of(int count) {
  std::vector<MapValue> parameters = sectors_of(count);
  parameters.push_back({.param = kRatiosATexel.id, .value = 1});
  return parameters;
}

TEST(SectorMap, TexelsHaveTheOppositeSectorsRatioToo) {
  const Heightfield heights = quantise_heights(noise_map(6, 5), TexelType::unorm8);
  const MapRow& map = find_map(MapKind::sector);
  for (const Wrap wrap : kWraps)
    for (const int count : kCounts)
      for (const std::string_view format : {"rg8", "rg16f"}) {
        const auto textures_of = [&](const std::vector<MapValue>& parameters) {
          const auto values = bake_sector({.heights = heights, .wrap = wrap, .parameters = parameters, .threads = 1});
          return pack_map({.map = map, .heights = heights, .values = values, .wrap = wrap, .parameters = parameters},
                          find_format(format), find_encoding("sqrt"));
        };
        const MapTextures alone = textures_of(sectors_of(count));
        const MapTextures paired = textures_of(paired_sectors_of(count));
        const TextureImage& atlas = paired.extra.value();
        EXPECT_EQ(atlas.layout.channels, 4);
        EXPECT_EQ(paired.relief.texels, alone.relief.texels);
        for (const int channel : {0, 1})
          EXPECT_EQ(read_channel(atlas, channel), read_channel(alone.extra.value(), channel));
        EXPECT_EQ(read_channel(atlas, 3), std::vector<float>(read_channel(atlas, 3).size(), 0.0F));
        const int layer_width = heights.width + 2;
        const int layer_height = heights.height + 2;
        const int columns = SectorAtlas(count, heights.width, heights.height).columns;
        const auto own = read_channel(atlas, 1);
        const auto opposite = read_channel(atlas, 2);
        for (int k = 0; k < count; ++k)
          for (int y = 0; y < layer_height; ++y)
            for (int x = 0; x < layer_width; ++x) {
              const auto place = [&](int layer) {
                return static_cast<std::size_t>((layer / columns * layer_height + y) * atlas.width +
                                                layer % columns * layer_width + x);
              };
              ASSERT_EQ(opposite[place(k)], own[place(k ^ 3)]);
            }
      }
}

TEST(SectorMap, OppositeRatiosAreProvedAsTheyAreStored) {
  const Heightfield heights = quantise_heights(noise_map(12, 9), TexelType::unorm8);
  const MapRow& map = find_map(MapKind::sector);
  const std::vector<MapValue> parameters = paired_sectors_of(8);
  const auto values =
      bake_sector({.heights = heights, .correction = Correction::safe, .parameters = parameters, .threads = 1});
  const Format& format = find_format("rg8");
  const Encoding& encoding = find_encoding("sqrt");
  MapTextures textures =
      pack_map({.map = map, .heights = heights, .values = values, .parameters = parameters}, format, encoding);
  const auto verified = [&] {
    return verify_map({.map = map,
                       .textures = textures,
                       .format = format,
                       .encoding = encoding,
                       .correction = Correction::safe,
                       .threads = 1,
                       .parameters = parameters});
  };
  const MapVerdict sound = verified();
  EXPECT_EQ(sound.texels, 2 * 8 * 12 * 9);
  EXPECT_FALSE(sound.broken || sound.undecided);
  TextureImage& atlas = textures.extra.value();
  for (std::size_t i = 2; i < atlas.texels.size(); i += 4) atlas.texels[i] = std::byte{255};
  EXPECT_TRUE(verified().broken);
}

TEST(SectorMap, LayersComeBackFromTheirAtlas) {
  const Heightfield heights = quantise_heights(noise_map(6, 5), TexelType::unorm16);
  const MapRow& map = find_map(MapKind::sector);
  for (const Wrap wrap : kWraps)
    for (const int count : kCounts) {
      const std::vector<MapValue> parameters = sectors_of(count);
      const auto values = bake_sector({.heights = heights, .wrap = wrap, .parameters = parameters, .threads = 1});
      const Format& format = find_format("rg16");
      const Encoding& encoding = find_encoding("ratio");
      const MapTextures textures = pack_map(
          {.map = map, .heights = heights, .values = values, .wrap = wrap, .parameters = parameters}, format, encoding);
      const auto layers = cone_layers(map, textures, parameters);
      ASSERT_EQ(layers.size(), static_cast<std::size_t>(count));
      for (std::size_t k = 0; k < layers.size(); ++k) {
        const UnpackedMap layer = unpack_map(layers[k], format, encoding);
        EXPECT_EQ(layer.heights.texels, heights.texels);
        for (std::size_t i = 0; i < layer.ratios.size(); ++i)
          EXPECT_EQ(layer.ratios[i],
                    floor_ratio(values[k * heights.texels.size() + i], heights.texels[i], format.type, encoding));
      }
      // The border of a layer repeats what stands on the other side, or beside it.
      const auto all = read_channel(textures.extra.value(), 0);
      const SectorAtlas atlas(count, heights.width, heights.height);
      const auto at = [&](int x, int y) {
        return all[static_cast<std::size_t>(y) * static_cast<std::size_t>(atlas.width) + static_cast<std::size_t>(x)];
      };
      for (int y = 0; y < atlas.height; ++y)
        for (int x = 0; x < atlas.width; ++x)
          ASSERT_EQ(at(x, y), heights.at(wrapped(x % (heights.width + 2) - 1, heights.width, wrap),
                                         wrapped(y % (heights.height + 2) - 1, heights.height, wrap)));
    }
}

}  // namespace
}  // namespace reliefbench
