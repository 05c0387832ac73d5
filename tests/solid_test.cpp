// Solids between two heights a texel: how they are read, their exact hits, their maps and what is judged of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>
#include <span>

#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/image/heightmaps.h"
#include "kernels/judge/score.h"
#include "kernels/maps/map_texture.h"
#include "kernels/maps/map_verify.h"
#include "kernels/maps/solid_map.h"
#include "kernels/trace/guarantee.h"
#include "tests/slow_solid.h"
#include "tests/solid_cases.h"

namespace reliefbench {
namespace {

constexpr double kPassesAll = std::numeric_limits<double>::infinity();
/// Whether a hit is the oracle's, or differs only where the ray grazes the solid: there it touches less than a hair.
enum class Agreement { same, grazing, no };
Agreement agreement(const Heightfield& solid, Wrap wrap, const TextureRay& ray, const ReferenceHit& hit) {
  constexpr double kHair = 1e-9;
  const ReferenceHit slow = SlowSolid(solid, wrap, ray).trace();
  const auto near = [](double a, double b) { return a == b || std::abs(a - b) < kHair; };
  if (near(hit.t_enter, slow.t_enter) && near(hit.t_exit, slow.t_exit)) return Agreement::same;
  const bool slow_is_thin = !slow.passes() && slow.t_exit - slow.t_enter < kHair;
  const bool is_thin = !hit.passes() && hit.t_exit - hit.t_enter < kHair;
  const bool enters_alike = near(hit.t_enter, slow.t_enter) || slow_is_thin || is_thin;
  return enters_alike ? Agreement::grazing : Agreement::no;
}

TEST(SolidReference, AgreesWithTheOracle) {
  SolidRandom random(1);
  int rays = 0;
  int grazing = 0;
  int passing = 0;
  for (const SolidCase& one : solid_cases(random))
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const ReferenceTracer tracer(one.solid, wrap);
      for (int i = 0; i < 60; ++i, ++rays) {
        const TextureRay ray = some_ray(one.solid, random);
        const ReferenceHit hit = tracer.trace(ray);
        const Agreement found = agreement(one.solid, wrap, ray, hit);
        passing += hit.passes() ? 1 : 0;
        grazing += found == Agreement::grazing ? 1 : 0;
        const ReferenceHit slow = SlowSolid(one.solid, wrap, ray).trace();
        ASSERT_NE(found, Agreement::no) << one.name << " " << one.solid.width << "x" << one.solid.height << " wrap "
                                        << static_cast<int>(wrap) << " ray " << ray.u << " " << ray.v << " "
                                        << ray.slope_u << " " << ray.slope_v << ": " << hit.t_enter << " " << hit.t_exit
                                        << ", slowly " << slow.t_enter << " " << slow.t_exit;
        EXPECT_EQ(tracer.first_hit(ray), hit.t_enter);
        if (hit.passes()) continue;
        EXPECT_LT(SlowSolid(one.solid, wrap, ray).outside(hit.t_enter), 1e-10) << one.name;
      }
    }
  EXPECT_LE(grazing, rays / 50) << "only grazing rays may differ";
  EXPECT_GT(passing, rays / 5);
  EXPECT_LT(passing, rays - rays / 5);
}

TEST(SolidReference, AFloorAtTheBottomIsTheRelief) {
  SolidRandom random(2);
  Heightfield relief{.width = 9, .height = 7, .texels = {}};
  for (int i = 0; i < 63; ++i) relief.texels.push_back(static_cast<float>(between(random, 0.01, 1)));
  Heightfield solid = relief;
  solid.floors.assign(63, 0.0F);
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
    for (int i = 0; i < 200; ++i) {
      const TextureRay ray = some_ray(solid, random);
      const ReferenceHit plain = ReferenceTracer(relief, wrap).trace(ray);
      const ReferenceHit hit = ReferenceTracer(solid, wrap).trace(ray);
      EXPECT_NEAR(hit.t_enter, plain.t_enter, 1e-12);
    }
}

TEST(SolidReference, ABallIsHitWhereItsSphereIs) {
  // Heights of a ball, 0.4 high and 0.375 wide each way. The bilinear surface is off it by no more than a cell's
  // diagonal squared over 8 times the second derivative, and that is under 35 in uv where q < 0.8.
  constexpr double kHigh = 0.4;
  constexpr double kWide = 0.375;
  constexpr int kSide = 256;
  constexpr double kOff = 2.0 / kSide / kSide / 8 * 35;
  const Heightfield ball = load_heightmap({.source = "ball", .width = kSide, .height = kSide});
  const ReferenceTracer tracer(ball, Wrap::clamp);
  SolidRandom random(3);
  int hits = 0;
  int passes = 0;
  int from_below = 0;
  for (int i = 0; i < 4000; ++i) {
    // Through a point near the ball: level ones meet its lower half.
    const double steep = i % 2 == 0 ? 1.5 : 12;
    const double slope_u = between(random, -steep, steep);
    const double slope_v = between(random, -steep, steep);
    const double z_past = between(random, 0, 0.9);
    const TextureRay ray{static_cast<float>(between(random, 0, 1) - slope_u * z_past),
                         static_cast<float>(between(random, 0, 1) - slope_v * z_past), static_cast<float>(slope_u),
                         static_cast<float>(slope_v)};
    // Of |p| = 1 in the ball's own measure: a t^2 + 2 b t + c.
    const std::array p{(ray.u - 0.5) / kWide, (ray.v - 0.5) / kWide, 0.5 / kHigh};
    const std::array d{ray.slope_u / kWide, ray.slope_v / kWide, -1 / kHigh};
    const auto dot = [](const auto& a, const auto& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    const double a = dot(d, d);
    const double b = dot(p, d);
    const double disc = b * b - a * (dot(p, p) - 1);
    const double nearest2 = dot(p, p) - b * b / a;  // of the ray to the middle, squared
    const ReferenceHit hit = tracer.trace(ray);
    if (nearest2 > 1.1) {
      EXPECT_TRUE(hit.passes());
      ++passes;
    }
    if (nearest2 > 0.9) continue;
    ASSERT_FALSE(hit.passes());
    ++hits;
    const double q = std::pow((ray.u + ray.slope_u * hit.t_enter - 0.5) / kWide, 2) +
                     std::pow((ray.v + ray.slope_v * hit.t_enter - 0.5) / kWide, 2);
    if (q > 0.8) continue;
    const double t = (-b - std::sqrt(disc)) / a;
    const double z = 1 - hit.t_enter;
    EXPECT_NEAR(std::abs(z - 0.5), kHigh * std::sqrt(1 - q), kOff);
    EXPECT_NEAR(hit.t_enter, t, 0.01);
    from_below += z < 0.5 ? 1 : 0;
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(passes, 500);
  EXPECT_GT(from_below, 5);
}

TEST(SolidReference, RaysPassHolesAndWhatHasNoThickness) {
  const Heightfield nothing = load_heightmap({.source = "nothing", .width = 16, .height = 16});
  const Heightfield sheet = made_solid(6, 6, [](int x, int, bool) { return 0.1 * x + 0.2; });
  const Heightfield ball = load_heightmap({.source = "ball", .width = 64, .height = 64});
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    for (const Heightfield* solid : {&nothing, &sheet})
      for (const TextureRay& ray : {TextureRay{0.3F, 0.4F, 0, 0}, TextureRay{0.1F, 0.2F, 7, -3}})
        EXPECT_TRUE(ReferenceTracer(*solid, wrap).trace(ray).passes());
    EXPECT_TRUE(ReferenceTracer(ball, wrap).trace({0.02F, 0.02F, 0, 0}).passes());
    const ReferenceHit middle = ReferenceTracer(ball, wrap).trace({0.5F, 0.5F, 0, 0});
    EXPECT_NEAR(middle.t_enter, 0.1, 1e-3);
    EXPECT_NEAR(middle.t_exit, 0.9, 1e-3);
  }
}

TEST(SolidReference, RaysThatAreNotFinitePass) {
  const Heightfield ball = load_heightmap({.source = "ball", .width = 8, .height = 8});
  const float infinity = std::numeric_limits<float>::infinity();
  for (const TextureRay& ray : {TextureRay{0.5F, 0.5F, infinity, 0}, TextureRay{0.5F, 0.5F, 1e30F, 0}})
    EXPECT_TRUE(ReferenceTracer(ball, Wrap::repeat).trace(ray).passes());
}

TEST(SolidHeights, AFloorChangesTheHashAndNoneDoesNot) {
  Heightfield plain{.width = 2, .height = 2, .texels = {0.5F, 0.25F, 0.75F, 1}};
  const std::string before = heights_sha256(plain);
  Heightfield solid = plain;
  solid.floors = {0, 0, 0, 0};
  EXPECT_NE(heights_sha256(solid), before);
  Heightfield other = solid;
  other.floors.back() = 0.5F;
  EXPECT_NE(heights_sha256(other), heights_sha256(solid));
}

TEST(SolidHeights, AreReadFromTwoChannels) {
  const std::filesystem::path file =
      std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data/images/grey_alpha_16.png";
  std::string reading;
  const Heightfield solid = load_heightmap({.source = file.string(), .channel = "r", .floor = "a"}, &reading);
  ASSERT_TRUE(solid.is_solid());
  EXPECT_EQ(solid.texels, load_heightmap({.source = file.string(), .channel = "r"}).texels);
  EXPECT_EQ(solid.floors, load_heightmap({.source = file.string(), .channel = "a"}).texels);
  EXPECT_NE(reading.find("floor a"), std::string::npos) << reading;
  EXPECT_EQ(reading.find("ignored"), std::string::npos) << reading;
  EXPECT_THROW(static_cast<void>(load_heightmap({.source = file.string(), .floor = "b"})), Error);
  EXPECT_THROW(static_cast<void>(load_heightmap({.source = file.string(), .floor = "auto"})), Error);
  const Heightfield depths = load_heightmap({.source = file.string(), .channel = "r", .invert = true, .floor = "a"});
  EXPECT_EQ(depths.floors.front(), 1.0F - solid.floors.front());
}

TEST(SolidMaps, NeedFloors) {
  const Heightfield plain = load_heightmap({.source = "fbm", .width = 8, .height = 8});
  for (const MapKind kind : {MapKind::double_height, MapKind::double_cone, MapKind::double_mip})
    EXPECT_THROW(static_cast<void>(find_map(kind).bake({.heights = plain})), Error);
}

TEST(SolidMaps, ConesAreThoseOfEverySingleTexel) {
  SolidRandom random(4);
  for (const SolidCase& one : solid_cases(random)) {
    const Heightfield& solid = one.solid;
    if (solid.texels.size() > 200) continue;
    const std::vector<float> ratios = bake_double_cone({.heights = solid, .wrap = Wrap::clamp});
    ASSERT_EQ(ratios.size(), 2 * solid.texels.size());
    for (int y = 0; y < solid.height; ++y)
      for (int x = 0; x < solid.width; ++x) {
        double up = 1;
        double down = 1;
        for (int j = 0; j < solid.height; ++j)
          for (int i = 0; i < solid.width; ++i) {
            const double away = std::hypot(1.0 * (i - x) / solid.width, 1.0 * (j - y) / solid.height);
            const double rise = static_cast<double>(solid.at(i, j)) - static_cast<double>(solid.at(x, y));
            const double fall = static_cast<double>(solid.floor_at(x, y)) - static_cast<double>(solid.floor_at(i, j));
            if (rise > 0) up = std::min(up, away / rise);
            if (fall > 0) down = std::min(down, away / fall);
          }
        EXPECT_NEAR(ratios[2 * solid.index(x, y)], up, 1e-6) << one.name;
        EXPECT_NEAR(ratios[2 * solid.index(x, y) + 1], down, 1e-5) << one.name;
        EXPECT_LE(ratios[2 * solid.index(x, y)], up + 1e-15);
        EXPECT_LE(ratios[2 * solid.index(x, y) + 1], down + 1e-15) << one.name;
      }
  }
}

/// Bilinear between the centres of a map's texels, in double.
double interpolated_value(std::span<const float> values, int stride, int first, const Heightfield& map, Wrap wrap,
                          double u, double v) {
  const double x = u * map.width - 0.5;
  const double y = v * map.height - 0.5;
  const int left = static_cast<int>(std::floor(x));
  const int low = static_cast<int>(std::floor(y));
  const auto at = [&](int i, int j) {
    const std::size_t texel = map.index(wrapped(left + i, map.width, wrap), wrapped(low + j, map.height, wrap));
    return static_cast<double>(values[texel * static_cast<std::size_t>(stride) + static_cast<std::size_t>(first)]);
  };
  return std::lerp(std::lerp(at(0, 0), at(1, 0), x - left), std::lerp(at(0, 1), at(1, 1), x - left), y - low);
}

TEST(SolidMaps, NoPointOfTheSolidIsInASafeCone) {
  SolidRandom random(5);
  for (const SolidCase& one : solid_cases(random))
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const Heightfield& solid = one.solid;
      const std::vector<float> ratios =
          bake_double_cone({.heights = solid, .wrap = wrap, .correction = Correction::safe});
      const auto value = [&](std::span<const float> values, int stride, int first, double u, double v) {
        return interpolated_value(values, stride, first, solid, wrap, u, v);
      };
      for (int i = 0; i < 400; ++i) {
        const double u = between(random, 0, 1);
        const double v = between(random, 0, 1);
        const double angle = between(random, 0, 2 * std::numbers::pi);
        const double reach = between(random, 0, 1);  // of heights, from the apex
        for (const int side : {0, 1}) {
          const double radius = value(ratios, 2, side, u, v) * reach * between(random, 0, 0.999);
          const double at_u = u + radius * std::cos(angle);
          const double at_v = v + radius * std::sin(angle);
          const double apex = value(side == 0 ? solid.texels : solid.floors, 1, 0, u, v);
          const double z = side == 0 ? apex + reach : apex - reach;
          const double top = value(solid.texels, 1, 0, at_u, at_v);
          const double floor = value(solid.floors, 1, 0, at_u, at_v);
          EXPECT_FALSE(z < top - 1e-9 && z > floor + 1e-9) << one.name << " side " << side;
        }
      }
    }
}

TEST(SolidMaps, NodesHoldAllOfTheSolid) {
  SolidRandom random(6);
  for (const SolidCase& one : solid_cases(random))
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const Heightfield& solid = one.solid;
      const std::vector<float> nodes = bake_double_mip({.heights = solid, .wrap = wrap});
      for (int y = 0; y < solid.height; ++y)
        for (int x = 0; x < solid.width; ++x) {
          float top = 0;
          float floor = 1;
          bool is_thick = false;
          for (const int i : {0, 1, 2, 3}) {
            const std::size_t texel =
                solid.index(wrapped(x + i % 2, solid.width, wrap), wrapped(y + i / 2, solid.height, wrap));
            is_thick = is_thick || solid.texels[texel] > solid.floors[texel];
            top = std::max(top, solid.texels[texel]);
            floor = std::min(floor, solid.floors[texel]);
          }
          std::size_t first = 0;
          for (int level = 0; std::max(solid.width, solid.height) >> level > 0; ++level) {
            const int width = level_side(solid.width, level);
            const int height = level_side(solid.height, level);
            const auto node =
                first + static_cast<std::size_t>(std::min(y >> level, height - 1)) * static_cast<std::size_t>(width) +
                static_cast<std::size_t>(std::min(x >> level, width - 1));
            if (is_thick) {
              EXPECT_GE(nodes[2 * node], top) << one.name << " level " << level;
              EXPECT_LE(nodes[2 * node + 1], floor) << one.name << " level " << level;
            }
            first += static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
          }
          ASSERT_EQ(2 * first, nodes.size());
        }
      // And no more than that.
      float top = 0;
      float floor = 1;
      for (std::size_t i = 0; i < solid.texels.size(); ++i) {
        top = std::max(top, nodes[2 * i]);
        floor = std::min(floor, nodes[2 * i + 1]);
      }
      EXPECT_EQ(nodes[nodes.size() - 2], top) << one.name;
      EXPECT_EQ(nodes.back(), floor) << one.name;
    }
}

TEST(SolidMaps, StoredConesKeepTheirPromise) {
  for (const std::string name : {"ball", "goblet", "specks", "grille"})
    for (const std::string format_id : {"r8+rgba8", "r16+rgba16", "r16f+rgba16f", "r32f+rgba32f"})
      for (const std::string encoding_id : {"sqrt", "h_tan"}) {
        const Format& format = find_format(format_id);
        const Encoding& encoding = find_encoding(encoding_id);
        const MapRow& map = find_map(MapKind::double_cone);
        const Heightfield heights =
            quantise_heights(load_heightmap({.source = name, .width = 16, .height = 16}), format.type);
        const std::vector<float> values =
            bake_double_cone({.heights = heights, .wrap = Wrap::repeat, .correction = Correction::safe});
        const MapTextures textures =
            pack_map({.map = map, .heights = heights, .values = values, .wrap = Wrap::repeat}, format, encoding);
        const UnpackedMap unpacked = unpack_map(textures, format, encoding, true);
        EXPECT_EQ(unpacked.heights.floors, heights.floors);
        EXPECT_EQ(unpacked.heights.texels, heights.texels);
        for (std::size_t i = 0; i < heights.texels.size(); ++i)
          for (std::size_t k = 0; k < 2; ++k) EXPECT_LE(unpacked.ratios[3 * i + k], values[2 * i + k]);
        const MapVerdict verdict = verify_map({.map = map,
                                               .textures = textures,
                                               .format = format,
                                               .encoding = encoding,
                                               .correction = Correction::safe,
                                               .wrap = Wrap::repeat});
        EXPECT_EQ(verdict.texels, 512);
        EXPECT_FALSE(verdict.broken) << name << " " << format_id << " " << encoding_id;
      }
}

TEST(SolidMaps, AConeThatHoldsTheSolidFromBelowIsFound) {
  const Format& format = find_format("r32f+rgba32f");
  const Encoding& encoding = find_encoding("ratio");
  const MapRow& map = find_map(MapKind::double_cone);
  const Heightfield heights = load_heightmap({.source = "ball", .width = 16, .height = 16});
  std::vector<float> values =
      bake_double_cone({.heights = heights, .wrap = Wrap::repeat, .correction = Correction::safe});
  const auto verdict_of = [&] {
    return verify_map({.map = map,
                       .textures = pack_map({.map = map, .heights = heights, .values = values, .wrap = Wrap::repeat},
                                            format, encoding),
                       .format = format,
                       .encoding = encoding,
                       .correction = Correction::safe,
                       .wrap = Wrap::repeat});
  };
  EXPECT_FALSE(verdict_of().broken);
  values[2 * heights.index(3, 8) + 1] = 1;  // beside the rim, under it
  EXPECT_TRUE(verdict_of().broken);
}

TEST(SolidScore, CountsFalseHolesAndFalseSolids) {
  const auto pixel = [](PixelStatus status, float t) {
    return ScorePixel{
        .ray = {0.5F, 0.5F, 0.1F, 0}, .t = t, .status = static_cast<float>(status), .taps = 3, .steps = 1};
  };
  const ReferenceHit solid{.t_enter = 0.5, .t_exit = 0.7};
  const ReferenceHit hole{.t_enter = kPassesAll, .t_exit = kPassesAll};
  const std::vector<ScorePixel> pixels{pixel(PixelStatus::hit, 0.5F), pixel(PixelStatus::passed, 1),
                                       pixel(PixelStatus::hit, 1),    pixel(PixelStatus::passed, 1),
                                       pixel(PixelStatus::no_ray, 0), pixel(PixelStatus::step_cap, 0.2F)};
  const std::vector<ReferenceHit> reference{solid, solid, hole, hole, {}, hole};
  const JudgedFrame frame = judge(pixels, reference, 100, 100, true);
  EXPECT_EQ(frame.score.pixels, 5);
  EXPECT_EQ(frame.score.at("false_hole_rate"), 0.2);
  EXPECT_EQ(frame.score.at("false_solid_rate"), 0.4);
  EXPECT_NEAR(frame.score.at("coverage_error"), 0.6, 1e-15);
  EXPECT_EQ(frame.score.at("e_xy.max"), 0) << "of the pixel that hits what it should";
  EXPECT_EQ(frame.score.at("taps.mean"), 3);
  EXPECT_EQ(frame.pixels[3].verdict, Verdict::passed);
}

TEST(SolidScore, AReliefHasNoCoverage) {
  const std::vector<ScorePixel> pixels{
      {.ray = {0.5F, 0.5F, 0, 0}, .t = 0.5F, .status = static_cast<float>(PixelStatus::hit), .taps = 1, .steps = 1}};
  const std::vector<ReferenceHit> reference{{.t_enter = 0.5, .t_exit = kPassesAll}};
  EXPECT_FALSE(judge(pixels, reference, 8, 8).score["coverage_error"]);
  EXPECT_EQ(judge(pixels, reference, 8, 8, true).score.at("coverage_error"), 0);
}

TEST(SolidScore, AFrameOfHolesAloneHasNoErrorsOfHits) {
  const std::vector<ScorePixel> pixels{
      {.ray = {0.5F, 0.5F, 0, 0}, .t = 1, .status = static_cast<float>(PixelStatus::passed), .taps = 1, .steps = 1}};
  const std::vector<ReferenceHit> reference{{.t_enter = kPassesAll, .t_exit = kPassesAll}};
  const FrameScore score = judge(pixels, reference, 8, 8, true).score;
  EXPECT_EQ(score.at("coverage_error"), 0);
  EXPECT_EQ(score.at("e_xy.p99"), 0);
  EXPECT_EQ(score.at("missed_rate"), 0);
}

}  // namespace
}  // namespace reliefbench
