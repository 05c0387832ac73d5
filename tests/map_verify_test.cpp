#include "kernels/maps/map_verify.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/stored_cones.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"

namespace reliefbench {
namespace {

struct Storage {
  std::string_view format;
  std::string_view encoding;
};
constexpr Storage kStorages[] = {{"rg32f", "ratio"}, {"rg16", "sqrt"}, {"rg8", "h_tan"},     {"rg16f", "atan"},
                                 {"bc5", "sqrt"},    {"bc5", "atan"},  {"eac_rg11", "sqrt"}, {"eac_rg11", "atan"},
                                 {"bc7", "sqrt"},    {"bc7", "h_tan"}, {"astc", "sqrt"},     {"astc", "atan"}};

/// A map as it is stored, with the values that a baker would have returned.
struct Stored {
  Heightfield heights;
  MapTextures textures;
};
template <typename Bake>
Stored store(const MapRow& map, const Heightfield& heights, Storage storage, Wrap wrap, const Bake& bake) {
  const Format& format = find_format(storage.format);
  Stored stored{.heights = quantise_heights(heights, format.type), .textures = {}};
  const std::vector<float> values = bake(stored.heights);
  stored.textures = pack_map({.map = map, .heights = stored.heights, .values = values, .wrap = wrap}, format,
                             find_encoding(storage.encoding));
  return stored;
}

MapVerdict verify(const MapRow& map, const Stored& stored, Storage storage, Correction correction, Wrap wrap,
                  int rays = 1 << 14) {
  return verify_map({.map = map,
                     .textures = stored.textures,
                     .format = find_format(storage.format),
                     .encoding = find_encoding(storage.encoding),
                     .correction = correction,
                     .wrap = wrap,
                     .rays = rays,
                     .threads = 1});
}

MapVerdict bake_and_verify(const Heightfield& heights, Storage storage, Correction correction, Wrap wrap,
                           MapKind kind = MapKind::conservative) {
  const MapRow& map = find_map(kind);
  const Stored stored = store(map, heights, storage, wrap, [&](const Heightfield& quantised) {
    return map.bake({.heights = quantised, .wrap = wrap, .correction = correction, .threads = 1});
  });
  return verify(map, stored, storage, correction, wrap);
}

TEST(MapVerify, ProvesSafeMaps) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const Heightfield& heights : {map.make(17, 16), map.make(24, 7)}) {
      for (const Wrap wrap : kWraps) {
        for (const Storage storage : kStorages) {
          for (const Correction correction : {Correction::safe, Correction::certified, Correction::min4}) {
            if (correction == Correction::certified && storage.encoding == "h_tan") continue;  // not made for it
            SCOPED_TRACE(fmt::format("{} {} {} {} {}", map.id, heights.width, storage.encoding,
                                     correction_id(correction), wrap == Wrap::repeat ? "repeat" : "clamp"));
            const MapVerdict verdict = bake_and_verify(heights, storage, correction, wrap);
            EXPECT_EQ(verdict.texels_too_wide, 0);
            EXPECT_EQ(verdict.cells.proved, verdict.cells.cells);
            const int border = wrap == Wrap::clamp ? 1 : 0;
            EXPECT_EQ(verdict.cells.cells, (heights.width - border) * (heights.height - border));
            EXPECT_FALSE(verdict.broken || verdict.undecided);
          }
        }
      }
    }
  }
}

/// A code of EAC as a device has it that repeats its bits to 16; of ASTC as binary16 has it.
float other_reading(float value, TexelType type) {
  const auto code = static_cast<unsigned>(std::lround(value * static_cast<float>(greatest_code(type))));
  if (type == TexelType::eac) return static_cast<float>(code << 5U | code >> 6U) / 65535;
  return code == 65535 ? 1.0F : static_cast<float>(code) / 65536;
}

MapTextures read_the_other_way(const MapTextures& textures) {
  MapTextures floats{.relief = textures.relief};
  floats.relief.layout.type = TexelType::float32;
  floats.relief.texels.clear();
  const std::vector<float> heights = read_channel(textures.relief, 0);
  const std::vector<float> ratios = read_channel(textures.relief, 1);
  for (std::size_t i = 0; i < heights.size(); ++i)
    for (const float value : {heights[i], ratios[i]}) {
      const float other = other_reading(value, textures.relief.layout.type);
      const auto bytes = std::as_bytes(std::span(&other, 1));
      floats.relief.texels.insert(floats.relief.texels.end(), bytes.begin(), bytes.end());
    }
  return floats;
}

// Without a correction cones are as wide as may be: there a margin that lacks would show.
TEST(MapVerify, CodesOfEacAndAstcMayBeReadEitherWay) {
  const MapRow& map = find_map(MapKind::conservative);
  for (const ConeTestMap& shape : kConeTestMaps)
    for (const Storage storage : {Storage{"eac_rg11", "ratio"}, Storage{"eac_rg11", "sqrt"},
                                  Storage{"eac_rg11", "atan"}, Storage{"eac_rg11", "h_tan"}, Storage{"astc", "ratio"},
                                  Storage{"astc", "sqrt"}, Storage{"astc", "atan"}, Storage{"astc", "h_tan"}})
      for (const Correction correction : {Correction::none, Correction::safe}) {
        SCOPED_TRACE(fmt::format("{} {} {} {}", shape.id, storage.format, storage.encoding, correction_id(correction)));
        const Stored stored = store(map, shape.make(64, 64), storage, Wrap::repeat, [&](const Heightfield& quantised) {
          return map.bake({.heights = quantised, .correction = correction});
        });
        const Stored seen{.heights = stored.heights, .textures = read_the_other_way(stored.textures)};
        const MapVerdict verdict = verify(map, seen, {"rg32f", storage.encoding}, correction, Wrap::repeat);
        EXPECT_EQ(verdict.texels_too_wide, 0);
        if (correction == Correction::safe) {
          EXPECT_EQ(verdict.cells.proved, verdict.cells.cells);
        }
      }
}

TEST(MapVerify, ProvesSafeMapsOfTheOtherConservativeKinds) {
  const Storage one{"rg16", "sqrt"};
  const Storage four{"r16+rgba16", "sqrt"};
  for (const auto make : {fbm_map, noise_map, checker_map, cliff_map}) {
    for (const Heightfield& heights : {make(16, 15), make(24, 8)}) {
      for (const Wrap wrap : kWraps) {
        EXPECT_EQ(bake_and_verify(heights, one, Correction::safe, wrap, MapKind::quick).cells.undecided, 0);
        EXPECT_EQ(bake_and_verify(heights, one, Correction::min4, wrap, MapKind::quick).cells.undecided, 0);
        const MapVerdict quad = bake_and_verify(heights, four, Correction::safe, wrap, MapKind::quad);
        EXPECT_EQ(quad.texels, 4 * heights.width * heights.height);
        EXPECT_EQ(quad.texels_too_wide, 0);
        EXPECT_EQ(quad.cells.proved, quad.cells.cells);
        EXPECT_FALSE(quad.broken || quad.undecided);
      }
    }
  }
}

TEST(MapVerify, EverySectorIsHeldToItsOwnTexels) {
  const MapRow& map = find_map(MapKind::quad);
  const Storage storage{"r32f+rgba32f", "ratio"};
  // A spike to the right of texel (2, 3): only the first sector sees it from there.
  const Heightfield spike = make_map(8, 8, [](int x, int y) { return x == 5 && y == 3 ? 0.5F : 0.0F; });
  for (const std::size_t sector : {0U, 1U, 2U, 3U}) {
    const Stored stored = store(map, spike, storage, Wrap::clamp, [&](const Heightfield&) {
      std::vector<float> ratios(std::size_t{4} * 64, 0.0F);
      ratios[4 * (3 * 8 + 2) + sector] = 0.9F;
      return ratios;
    });
    const MapVerdict verdict = verify(map, stored, storage, Correction::safe, Wrap::clamp);
    EXPECT_EQ(verdict.texels_too_wide, sector == 0 ? 1 : 0);
    EXPECT_EQ(verdict.broken, sector == 0);
    if (sector == 0) {
      EXPECT_NEAR(verdict.worst_texel.factor, 0.9 / (3.0 / 8 / 0.5), 1e-6);
    }
  }
}

TEST(MapVerify, ThePublishedQuickMapIsBrokenOnSpikes) {
  const Heightfield spikes = load_heightmap({.source = "spikes", .width = 128, .height = 128});
  const Storage storage{"rg16", "sqrt"};
  const MapVerdict published =
      bake_and_verify(spikes, storage, Correction::none, Wrap::repeat, MapKind::quick_published);
  EXPECT_TRUE(published.broken);
  EXPECT_GT(published.texels_too_wide, 0);
  EXPECT_GT(published.worst_texel.factor, 1.05);
  EXPECT_EQ(bake_and_verify(spikes, storage, Correction::none, Wrap::repeat, MapKind::quick).texels_too_wide, 0);
}

TEST(MapVerify, ExactRelaxedConesHoldAtTexels) {
  for (const auto make : {fbm_map, noise_map, bricks_map, spikes_map, pyramids_map, cliff_map}) {
    for (const Wrap wrap : kWraps) {
      const Heightfield heights = make(24, 20);
      const MapVerdict relaxed = bake_and_verify(heights, {"rg32f", "ratio"}, Correction::none, wrap, MapKind::relaxed);
      EXPECT_EQ(relaxed.texels_too_wide, 0);
      EXPECT_EQ(relaxed.broken, relaxed.rays.crossing_twice > 0);
      const MapVerdict shape =
          bake_and_verify(heights, {"r32f+rgba32f", "ratio"}, Correction::min3x3, wrap, MapKind::safety_shape);
      EXPECT_EQ(shape.texels_too_wide, 0);
      EXPECT_GT(shape.rays.rays, 1000);
    }
  }
}

// Inside a checkerboard's cell the true ratio is 1/(sqrt2 N), while texels hold 1/N.
TEST(MapVerify, FindsThatTheMinimumOfNeighboursIsNotEnough) {
  const MapVerdict checker = bake_and_verify(checker_map(16, 16), {"rg32f", "ratio"}, Correction::min3x3, Wrap::repeat);
  EXPECT_TRUE(checker.broken);
  EXPECT_EQ(checker.texels_too_wide, 0);
  EXPECT_EQ(checker.cells.broken, 256);
  EXPECT_NEAR(checker.cells.worst.factor, std::numbers::sqrt2, 1e-5);
  EXPECT_TRUE(bake_and_verify(noise_map(16, 16), {"rg16", "sqrt"}, Correction::min3x3, Wrap::clamp).broken);
}

// Shaders interpolate them all the same: "64931 broken" once stood above "guarantee holds".
TEST(MapVerify, HoldsUncorrectedMapsToEveryPoint) {
  const MapVerdict verdict = bake_and_verify(noise_map(16, 16), {"rg16", "sqrt"}, Correction::none, Wrap::repeat);
  EXPECT_GT(verdict.cells.broken, 0);
  EXPECT_EQ(verdict.texels_too_wide, 0);
  EXPECT_TRUE(verdict.broken);
}

TEST(MapVerify, NamesTheTexelThatIsTooWideAndByHowMuch) {
  const MapRow& map = find_map(MapKind::conservative);
  const Heightfield spike = make_map(16, 8, [](int x, int y) { return x == 5 && y == 3 ? 0.75F : 0.0F; });
  const Storage storage{"rg32f", "ratio"};
  for (const Correction correction : {Correction::none, Correction::safe}) {
    const Stored stored = store(map, spike, storage, Wrap::clamp, [&](const Heightfield& heights) {
      auto ratios = map.bake({.heights = heights, .wrap = Wrap::clamp, .correction = correction, .threads = 1});
      ratios[6 * 16 + 9] = 1.25F * static_cast<float>(std::hypot(4 / 16.0, 3 / 8.0) / 0.75);
      return ratios;
    });
    const MapVerdict verdict = verify(map, stored, storage, correction, Wrap::clamp);
    EXPECT_TRUE(verdict.broken);
    EXPECT_EQ(verdict.texels_too_wide, 1);
    EXPECT_NEAR(verdict.worst_texel.factor, 1.25, 1e-6);
    EXPECT_DOUBLE_EQ(verdict.worst_texel.u, 9.5 / 16);
    EXPECT_DOUBLE_EQ(verdict.worst_texel.v, 6.5 / 8);
    EXPECT_GE(verdict.cells.worst.factor, 1.25 - 1e-6);
    EXPECT_GE(verdict.cells.broken, 4);
  }
}

/// The image of texel b nearest to a, and further ones, as offsets in texels.
std::vector<int> offsets(int a, int b, int side, Wrap wrap) {
  if (wrap == Wrap::clamp) return {b - a};
  return {b - a - side, b - a, b - a + side};
}

/// Texels whose cones hold a texel v that `forbids(u, v, dx, dy)`.
template <typename Forbids>
int slow_too_wide(const Heightfield& heights, const std::vector<float>& ratios, Wrap wrap, const Forbids& forbids) {
  int count = 0;
  for (int u = 0; u < heights.width * heights.height; ++u) {
    bool too_wide = false;
    for (int v = 0; v < heights.width * heights.height; ++v) {
      const double rise = static_cast<double>(heights.texels[static_cast<std::size_t>(v)]) -
                          static_cast<double>(heights.texels[static_cast<std::size_t>(u)]);
      for (const int dy : offsets(u / heights.width, v / heights.width, heights.height, wrap))
        for (const int dx : offsets(u % heights.width, v % heights.width, heights.width, wrap)) {
          const double distance =
              std::hypot(static_cast<double>(dx) / heights.width, static_cast<double>(dy) / heights.height);
          const double reach = ratios[static_cast<std::size_t>(u)] * rise;
          too_wide =
              too_wide || (distance < reach * (1 - 1e-6) && forbids(v % heights.width, v / heights.width, dx, dy));
        }
    }
    count += too_wide ? 1 : 0;
  }
  return count;
}

/// Heights are eighths, so that a slope is exactly 0 or at least 1/8 of a texel's share of the way. (Ninths are not:
/// where theirs cancel on paper, floats descend by 3e-8, which the verifier sees and no finite piece does.)
struct CodedMap {
  Heightfield heights;
  std::vector<float> ratios;
  Wrap wrap;
};
CodedMap coded_map() {
  const int width = *rc::gen::inRange(2, 10);
  const int height = *rc::gen::inRange(2, 10);
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto codes = *rc::gen::container<std::vector<int>>(2 * count, rc::gen::inRange(0, 9));
  CodedMap map{.heights = {.width = width, .height = height, .texels = {}},
               .ratios = {},
               .wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp)};
  for (std::size_t i = 0; i < count; ++i) {
    map.heights.texels.push_back(static_cast<float>(codes[i]) / 8.0F);
    map.ratios.push_back(0.0937F * static_cast<float>(codes[count + i]));
  }
  return map;
}

RC_GTEST_PROP(MapVerifyProperty, TexelsAreCountedAsAllPairsCountThem, ()) {
  const CodedMap random = coded_map();
  const Storage storage{"rg32f", "ratio"};
  const auto count = [&](MapKind kind) {
    const MapRow& map = find_map(kind);
    const Stored stored =
        store(map, random.heights, storage, random.wrap, [&](const Heightfield&) { return random.ratios; });
    return verify(map, stored, storage, Correction::none, random.wrap, 1).texels_too_wide;
  };
  RC_ASSERT(count(MapKind::conservative) ==
            slow_too_wide(random.heights, random.ratios, random.wrap, [](int, int, int, int) { return true; }));
  // Along the way away from the apex, a short piece before and behind the texel.
  const auto descends = [&](int x, int y, int dx, int dy) {
    constexpr double kPiece = 1.0 / 1024;
    const double length = std::max(std::abs(dx), std::abs(dy));
    const double step_x = dx / length * kPiece;
    const double step_y = dy / length * kPiece;
    const auto surface = [&](double i, double j) { return slow_surface(random.heights, random.wrap, i, j); };
    // A bilinear cell bends by at most 2 of a piece squared, less than this bound. A slope that is not 0 is at least
    // 1/8 of 1/17, as ways are up to 17 texels long: more than the bound and the bend together, 5 pieces.
    const double ahead = surface(x + step_x, y + step_y) - surface(x, y);
    const double before = surface(x, y) - surface(x - step_x, y - step_y);
    return std::min(ahead, before) < -3 * kPiece * kPiece;
  };
  RC_ASSERT(count(MapKind::relaxed_po07) == slow_too_wide(random.heights, random.ratios, random.wrap, descends));
}

TEST(MapVerify, RaysThatCrossAThinWallTwiceAreFound) {
  const MapRow& map = find_map(MapKind::relaxed_po07);
  const Heightfield wall = make_map(32, 32, [](int x, int) { return x == 16 ? 0.5F : 0.0F; });
  const Storage storage{"rg32f", "ratio"};
  const auto rays_with = [&](float ratio) {
    const Stored stored = store(map, wall, storage, Wrap::clamp,
                                [&](const Heightfield&) { return std::vector<float>(std::size_t{32} * 32, ratio); });
    const MapVerdict verdict = verify(map, stored, storage, Correction::min3x3, Wrap::clamp);
    EXPECT_FALSE(verdict.broken) << "relaxed_po07 promises nothing";
    EXPECT_GT(verdict.rays.rays, 1000);
    return verdict.rays;
  };
  const RayVerdict wide = rays_with(1);
  EXPECT_GT(wide.crossing_twice, 0);
  EXPECT_GT(wide.worst.factor, 1.5);
  // As steep as the wall's sides: no ray inside such a cone gets through to the other side.
  EXPECT_EQ(rays_with(1.0F / 32 / 0.5F * 0.999F).crossing_twice, 0);
}

TEST(MapVerify, RefusesMapsWithoutCones) {
  const Heightfield heights = constant_map(4, 4);
  const Format& format = find_format("r16");
  const MapTextures textures = pack_heights(heights, format);
  EXPECT_THROW((void)verify_map({.map = find_map(MapKind::height),
                                 .textures = textures,
                                 .format = format,
                                 .encoding = find_encoding("ratio")}),
               Error);
}

TEST(StoredCones, NoPointOfABoxIsWiderThanItsBound) {
  const MapRow& map = find_map(MapKind::conservative);
  constexpr int kSteps = 16;
  for (const Storage storage : kStorages) {
    for (const ConeTestMap& heights : {ConeTestMap{"noise", noise_map}, ConeTestMap{"checker", checker_map},
                                       ConeTestMap{"pyramids", pyramids_map}}) {
      const Stored stored = store(map, heights.make(9, 9), storage, Wrap::repeat, [](const Heightfield& quantised) {
        return bake_conservative({.heights = quantised});
      });
      const StoredCones cones(stored.textures, find_format(storage.format), find_encoding(storage.encoding),
                              Wrap::repeat, false);
      for (int cell_index = 0; cell_index < 81; ++cell_index) {
        const StoredCones::Cell cell = cones.cell(cell_index % 9, cell_index / 9);
        for (const StoredCones::Box box : {StoredCones::Box{0, 0, 1, 1}, StoredCones::Box{0.25, 0.5, 0.5, 0.75}}) {
          const double bound = cones.widest(cell, box) * (1 + 1e-9);
          EXPECT_LE(bound, cones.greatest() * (1 + 1e-9));
          for (int j = 0; j <= kSteps; ++j)
            for (int i = 0; i <= kSteps; ++i)
              ASSERT_LE(cones.ratio(cell, std::lerp(box.fx0, box.fx1, static_cast<double>(i) / kSteps),
                                    std::lerp(box.fy0, box.fy1, static_cast<double>(j) / kSteps)),
                        bound)
                  << storage.encoding << " " << heights.id;
        }
      }
    }
  }
}

}  // namespace
}  // namespace reliefbench
