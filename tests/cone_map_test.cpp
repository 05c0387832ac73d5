#include "kernels/maps/cone_map.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>

#include "kernels/base/error.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"
#include "tests/test_heightmap.h"

namespace reliefbench {
namespace {

std::string label(std::string_view id, MapSize size, Wrap wrap) {
  return fmt::format("{} {}x{} {}", id, size.width, size.height, wrap == Wrap::repeat ? "repeat" : "clamp");
}

TEST(ConeMap, RowsAreFoundByKindAndHaveDistinctIds) {
  std::set<std::string_view> ids;
  for (const MapRow& row : map_kinds()) {
    EXPECT_EQ(&find_map(row.kind), &row);
    EXPECT_TRUE(ids.insert(row.id).second) << row.id;
    EXPECT_EQ(row.corrections.front(), Correction::none) << row.id;
    for (const std::string_view text : {row.description, row.source, row.guarantee}) EXPECT_NE(text, "") << row.id;
  }
  EXPECT_TRUE(ids.contains("conservative"));
  EXPECT_EQ(correction_id(Correction::safe), "safe");
  EXPECT_EQ(correction_id(Correction::min3x3), "min3x3");
}

TEST(ConeMap, EveryRowBakesEveryCorrectionItNames) {
  const Heightfield map = on_the_bottom(fbm_map(16, 16));
  for (const MapRow& row : map_kinds()) {
    for (const Correction correction : row.corrections) {
      const auto ratios = row.bake({.heights = map, .correction = correction, .threads = 1});
      if (row.content == MapContent::ratios) {
        EXPECT_EQ(ratios.size(), 256U * static_cast<unsigned>(row.ratios)) << row.id;
      } else {
        EXPECT_EQ(ratios.empty(), row.content == MapContent::heights) << row.id;
      }
    }
    for (const Correction correction : corrections()) {
      if (row.content != MapContent::ratios) continue;
      if (std::ranges::find(row.corrections, correction) != row.corrections.end()) continue;
      EXPECT_THROW((void)row.bake({.heights = map, .correction = correction}), Error) << row.id;
    }
  }
  EXPECT_THROW((void)bake_relaxed_po07({.heights = map, .parameters = {{kSearchSteps.id, 0}}}), Error);
  EXPECT_THROW((void)bake_quick({.heights = map, .parameters = {{kSearchSteps.id, 16}}}), Error);  // not its own
}

TEST(ConeMap, RefusesSidesUnderTwoTexels) {
  for (const MapSize size : {MapSize{1, 1}, MapSize{1, 8}, MapSize{8, 1}, MapSize{0, 0}}) {
    const Heightfield map = constant_map(size.width, size.height);
    for (const MapRow& row : map_kinds()) {
      try {
        (void)row.bake({.heights = map});
        ADD_FAILURE() << row.id << " took " << label("a map of", size, Wrap::repeat);
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), Exit::bad_input);
      }
    }
  }
  const Heightfield torn{.width = 4, .height = 4, .texels = std::vector<float>(15)};
  EXPECT_THROW((void)bake_conservative({.heights = torn}), Error);
}

TEST(ConeMap, ConservativeHasTheBitsOfAllPairs) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const MapSize size : {MapSize{2, 2}, MapSize{2, 7}, MapSize{3, 3}, MapSize{16, 16}, MapSize{33, 20},
                               MapSize{45, 9}, MapSize{37, 41}}) {
      const Heightfield heights = map.make(size.width, size.height);
      for (const Wrap wrap : kWraps) {
        SCOPED_TRACE(label(map.id, size, wrap));
        const auto slow = slow_conservative(heights, wrap, Correction::none);
        EXPECT_EQ(bake_conservative({.heights = heights, .wrap = wrap, .threads = 1}), slow);
        EXPECT_EQ(bake_conservative({.heights = heights, .wrap = wrap, .threads = 2}), slow);
        EXPECT_EQ(bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::min3x3, .threads = 1}),
                  min3x3(slow, size.width, size.height, wrap));
        EXPECT_EQ(bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::safe, .threads = 1}),
                  min3x3(slow_conservative(heights, wrap, Correction::safe), size.width, size.height, wrap));
      }
    }
  }
}

TEST(ConeMap, ConservativeHasTheBitsOfAllPairsOverSeveralBands) {
  const Heightfield heights = fbm_map(70, 101);
  for (const Wrap wrap : kWraps) {
    EXPECT_EQ(bake_conservative({.heights = heights, .wrap = wrap, .threads = 2}),
              slow_conservative(heights, wrap, Correction::none));
  }
}

TEST(ConeMap, EveryInstructionSetGivesTheSameBits) {
  const Heightfield heights = noise_map(45, 33);
  const auto choose = [](std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);  // 0: what the machine has
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  };
  const auto slow = slow_conservative(heights, Wrap::repeat, Correction::none);
  const auto slow_relaxed = slow_relaxed_po07(heights, Wrap::repeat, 16);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    choose(target);
    EXPECT_EQ(bake_conservative({.heights = heights, .threads = 1}), slow) << hwy::TargetName(target);
    EXPECT_EQ(bake_relaxed_po07({.heights = heights, .parameters = {{kSearchSteps.id, 16}}, .threads = 1}),
              slow_relaxed)
        << hwy::TargetName(target);
  }
  choose(0);
}

RC_GTEST_PROP(ConeMapProperty, BakersHaveTheBitsOfAllPairs, ()) {
  const int width = *rc::gen::inRange(2, 14);
  const int height = *rc::gen::inRange(2, 14);
  const int levels = *rc::gen::element(1, 2, 5, 255, 65535);  // few levels: many ties
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const auto codes =
      *rc::gen::container<std::vector<int>>(static_cast<std::size_t>(width) * height, rc::gen::inRange(0, levels + 1));
  const Heightfield heights = make_map(width, height, [&](int x, int y) {
    return static_cast<float>(codes[static_cast<std::size_t>(y) * width + x]) / static_cast<float>(levels);
  });
  RC_ASSERT(bake_conservative({.heights = heights, .wrap = wrap, .threads = 1}) ==
            slow_conservative(heights, wrap, Correction::none));
  const int steps = *rc::gen::inRange(1, 40);
  RC_ASSERT(
      bake_relaxed_po07({.heights = heights, .wrap = wrap, .parameters = {{kSearchSteps.id, steps}}, .threads = 1}) ==
      slow_relaxed_po07(heights, wrap, steps));
}

TEST(ConeMap, RelaxedHasTheBitsOfAllPairs) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const MapSize size : {MapSize{2, 2}, MapSize{5, 3}, MapSize{16, 16}, MapSize{21, 13}}) {
      const Heightfield heights = map.make(size.width, size.height);
      for (const Wrap wrap : kWraps) {
        SCOPED_TRACE(label(map.id, size, wrap));
        const auto slow = slow_relaxed_po07(heights, wrap, 24);
        EXPECT_EQ(
            bake_relaxed_po07({.heights = heights, .wrap = wrap, .parameters = {{kSearchSteps.id, 24}}, .threads = 1}),
            slow);
        EXPECT_EQ(bake_relaxed_po07({.heights = heights,
                                     .wrap = wrap,
                                     .correction = Correction::min3x3,
                                     .parameters = {{kSearchSteps.id, 24}},
                                     .threads = 2}),
                  min3x3(slow, size.width, size.height, wrap));
      }
    }
  }
}

TEST(ConeMap, ConesRoundASpikeAreItsDistances) {
  // A spike of height 3/4 at (5, 3): every other texel's cone touches its tip.
  const int width = 16;
  const int height = 8;
  const Heightfield map = make_map(width, height, [](int x, int y) { return x == 5 && y == 3 ? 0.75F : 0.0F; });
  const auto ratios = bake_conservative({.heights = map, .wrap = Wrap::clamp, .threads = 1});
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double distance_uv = std::hypot((x - 5) / 16.0, (y - 3) / 8.0);
      const double expected = distance_uv == 0 ? 1 : std::min(1.0, distance_uv / 0.75);
      const double ratio = ratios[static_cast<std::size_t>(y) * width + x];
      EXPECT_LE(ratio, expected * (1 + 1e-15));
      EXPECT_NEAR(ratio, expected, 1e-7) << x << ", " << y;
    }
  }
}

TEST(ConeMap, ConesBesideACliffGrowWithItsDistance) {
  const int side = 16;
  const Heightfield map = cliff_map(side, side);
  const auto clamp = bake_conservative({.heights = map, .wrap = Wrap::clamp, .threads = 1});
  const auto repeat = bake_conservative({.heights = map, .wrap = Wrap::repeat, .threads = 1});
  for (int x = 0; x < side; ++x) {
    const bool is_low = x < side / 2;
    EXPECT_EQ(clamp[static_cast<std::size_t>(x)], is_low ? static_cast<float>(8 - x) / 16 : 1.0F);
    EXPECT_EQ(repeat[static_cast<std::size_t>(x)], is_low ? static_cast<float>(std::min(8 - x, x + 1)) / 16 : 1.0F);
  }
}

TEST(ConeMap, NoConeHoldsATexelAndSomeTexelBoundsEachCone) {
  const Heightfield map = noise_map(29, 17);
  for (const Wrap wrap : kWraps) {
    const auto ratios = bake_conservative({.heights = map, .wrap = wrap, .threads = 1});
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const double ratio = ratios[static_cast<std::size_t>(y) * map.width + x];
        double least = 1;
        for (int j = 0; j < map.height; ++j) {
          for (int i = 0; i < map.width; ++i) {
            const double rise = static_cast<double>(map.at(i, j)) - static_cast<double>(map.at(x, y));
            if (rise <= 0) continue;
            const double distance = std::hypot(slow_offset(x, i, map.width, wrap) / map.width,
                                               slow_offset(y, j, map.height, wrap) / map.height);
            least = std::min(least, distance / rise);
          }
        }
        ASSERT_LE(ratio, least * (1 + 1e-12));
        ASSERT_GE(ratio, least * (1 - 2e-7));
      }
    }
  }
}

/// Pairs of points on the interpolated surface of which one lies inside the other's interpolated cone.
int surface_points_in_cones(const Heightfield& map, const std::vector<float>& ratios, Wrap wrap) {
  constexpr int kPerTexel = 4;
  const Heightfield cones{.width = map.width, .height = map.height, .texels = ratios};
  struct Point {
    double x, y, z, ratio;
  };
  std::vector<Point> points;
  for (int j = 0; j < map.height * kPerTexel; ++j) {
    for (int i = 0; i < map.width * kPerTexel; ++i) {
      const double x = static_cast<double>(i) / kPerTexel - 0.5;
      const double y = static_cast<double>(j) / kPerTexel - 0.5;
      points.push_back({.x = x, .y = y, .z = slow_surface(map, wrap, x, y), .ratio = slow_surface(cones, wrap, x, y)});
    }
  }
  const auto distance = [&](double a, double b, int side) {
    const double d = std::abs(a - b);
    return (wrap == Wrap::repeat ? std::min(d, side - d) : d) / side;
  };
  int inside = 0;
  for (const Point& p : points) {
    for (const Point& q : points) {
      const double reach = p.ratio * (q.z - p.z);
      if (reach <= 1e-9) continue;
      inside += std::hypot(distance(p.x, q.x, map.width), distance(p.y, q.y, map.height)) < reach * (1 - 1e-9) ? 1 : 0;
    }
  }
  return inside;
}

TEST(ConeMap, SafeAndCertifiedConesNeverMeetTheInterpolatedSurface) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const MapSize size : {MapSize{8, 8}, MapSize{11, 8}, MapSize{4, 12}}) {
      const Heightfield heights = map.make(size.width, size.height);
      for (const Wrap wrap : kWraps) {
        for (const Correction correction : {Correction::safe, Correction::certified}) {
          const auto ratios =
              bake_conservative({.heights = heights, .wrap = wrap, .correction = correction, .threads = 1});
          EXPECT_EQ(surface_points_in_cones(heights, ratios, wrap), 0) << label(map.id, size, wrap);
        }
      }
    }
  }
}

TEST(ConeMap, NoCertifiedConeIsNarrowerThanTheSafeOne) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const Wrap wrap : kWraps) {
      const Heightfield heights = map.make(28, 24);
      const auto safe =
          bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::safe, .threads = 1});
      const auto certified =
          bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::certified, .threads = 2});
      double gained = 0;
      for (std::size_t i = 0; i < safe.size(); ++i) {
        ASSERT_GE(certified[i], safe[i] * (1 - 0x1p-18F)) << map.id;
        gained += static_cast<double>(certified[i]) / static_cast<double>(safe[i]) - 1;
      }
      const bool is_tight =
          map.id == "checker" || map.id == "constant" || map.id == "pyramids";  // little to gain there
      EXPECT_EQ(gained / static_cast<double>(safe.size()) > 0.02, !is_tight) << map.id;
    }
  }
}

TEST(ConeMap, TheBakeForFourTexelMinimaIsSafeWithoutDilation) {
  const Heightfield heights = noise_map(24, 20);
  for (const Wrap wrap : kWraps) {
    const auto min4 = bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::min4});
    EXPECT_EQ(min3x3(min4, 24, 20, wrap),
              bake_conservative({.heights = heights, .wrap = wrap, .correction = Correction::safe}));
  }
}

TEST(ConeMap, TheMinimumOfNeighboursAloneIsNotSafe) {
  const Heightfield checker = checker_map(8, 8);
  const auto ratios =
      bake_conservative({.heights = checker, .wrap = Wrap::repeat, .correction = Correction::min3x3, .threads = 1});
  EXPECT_GT(surface_points_in_cones(checker, ratios, Wrap::repeat), 0);
}

TEST(ConeMap, SafeConesStayOpenOnLongMaps) {
  for (const MapSize size : {MapSize{32, 8}, MapSize{8, 32}, MapSize{24, 16}}) {
    const Heightfield heights = noise_map(size.width, size.height);
    for (const float ratio : bake_conservative({.heights = heights, .correction = Correction::safe, .threads = 1})) {
      ASSERT_GT(ratio, 0.2F / static_cast<float>(std::max(size.width, size.height)));
    }
  }
}

TEST(ConeMap, MinimumOverNeighboursWraps) {
  std::vector<float> ratios(20, 1.0F);
  ratios[0] = 0.25F;
  const auto repeat = min3x3(ratios, 5, 4, Wrap::repeat);
  const auto clamp = min3x3(ratios, 5, 4, Wrap::clamp);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      const auto i = static_cast<std::size_t>(y) * 5 + static_cast<std::size_t>(x);
      EXPECT_EQ(clamp[i] == 0.25F, x <= 1 && y <= 1);
      EXPECT_EQ(repeat[i] == 0.25F, x != 2 && x != 3 && y != 2);
    }
  }
}

TEST(ConeMap, RelaxedConesAreNeverNarrowerThanConservativeOnes) {
  for (const ConeTestMap& map : kConeTestMaps) {
    const Heightfield heights = map.make(32, 24);
    for (const Wrap wrap : kWraps) {
      const auto conservative = bake_conservative({.heights = heights, .wrap = wrap, .threads = 1});
      const auto relaxed = bake_relaxed_po07({.heights = heights, .wrap = wrap, .threads = 1});
      for (std::size_t i = 0; i < relaxed.size(); ++i) ASSERT_GE(relaxed[i], conservative[i]) << map.id;
    }
  }
}

TEST(ConeMap, ARelaxedConeEndsBehindAWall) {
  // A wall of height 1/2, texels 8 to 10 of 32, on the ground: the ray from (4, 1) through the wall's front top goes
  // down at 4 texels per 1/2, so behind the back face (a slope from 10 to 11) it is long underground. The tightest
  // exit is over the back edge: the ray through (10, 1/2), out of the relief at once.
  const Heightfield map = make_map(32, 32, [](int x, int) { return x >= 8 && x <= 10 ? 0.5F : 0.0F; });
  const int steps = 4096;
  const auto ratios =
      bake_relaxed_po07({.heights = map, .wrap = Wrap::clamp, .parameters = {{kSearchSteps.id, steps}}, .threads = 1});
  const auto conservative = bake_conservative({.heights = map, .wrap = Wrap::clamp, .threads = 1});
  const std::size_t texel = 16 * 32 + 4;
  EXPECT_FLOAT_EQ(conservative[texel], 4.0F / 32 / 0.5F);
  EXPECT_NEAR(ratios[texel], 6.0 / 32 / 0.5, 2e-3);
}

TEST(ConeMap, RaysFromTheTopLeaveTheReliefOnlyOutsideTheRelaxedCone) {
  const int steps = 512;
  for (const auto make : {fbm_map, bricks_map, pyramids_map}) {
    const Heightfield map = make(18, 18);
    for (const Wrap wrap : kWraps) {
      const auto ratios =
          bake_relaxed_po07({.heights = map, .wrap = wrap, .parameters = {{kSearchSteps.id, steps}}, .threads = 1});
      for (int source = 0; source < 18 * 18; source += 5) {
        const int column = source % 18;
        const int row = source / 18;
        for (int target = 0; target < 18 * 18; ++target) {
          const double dx = slow_offset(column, target % 18, 18, wrap);
          const double dy = slow_offset(row, target / 18, 18, wrap);
          const double low = map.texels[static_cast<std::size_t>(source)];
          const double high = map.texels[static_cast<std::size_t>(target)];
          if (high <= low || high >= 1) continue;
          // From the target's surface point downwards, as long as the ray is inside the cone.
          bool was_inside = true;
          for (int step = 1; step <= steps; ++step) {
            const double z = high - high * step / steps;
            const double s = (1 - z) / (1 - high);
            const double ratio = ratios[static_cast<std::size_t>(source)];
            if (std::hypot(dx, dy) * s / 18 >= ratio * (z - low) * (1 - 1e-6)) break;
            const bool is_inside = slow_surface(map, wrap, column + dx * s, row + dy * s) > z - 1e-9;
            ASSERT_TRUE(is_inside || !was_inside) << source << " to " << target << " at step " << step;
            was_inside = is_inside;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace reliefbench
