#include "kernels/maps/cone_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <utility>

#include "kernels/base/error.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"

namespace reliefbench {
namespace {

constexpr int kPerTexel = 8;

/// Cones of sampled points of the surface against all sampled points: never narrower than the true ratios.
class SampledCones {
 public:
  SampledCones(const Heightfield& heights, Wrap wrap, double max_ratio)
      : width_(fine_side(heights.width, kPerTexel, wrap)), ratios_() {
    struct Point {
      double x, y, z;
    };
    std::vector<Point> points;
    for (int j = 0; j < fine_side(heights.height, kPerTexel, wrap); ++j) {
      for (int i = 0; i < width_; ++i) {
        const double x = static_cast<double>(i) / kPerTexel;
        const double y = static_cast<double>(j) / kPerTexel;
        points.push_back({.x = x, .y = y, .z = slow_surface(heights, wrap, x, y)});
      }
    }
    const auto distance = [&](double a, double b, int side) {
      const double d = std::abs(a - b);
      return (wrap == Wrap::repeat ? std::min(d, side - d) : d) / side;
    };
    for (const Point& p : points) {
      double least = max_ratio * max_ratio;
      for (const Point& q : points) {
        if (q.z <= p.z) continue;
        const double dx = distance(p.x, q.x, heights.width);
        const double dy = distance(p.y, q.y, heights.height);
        least = std::min(least, (dx * dx + dy * dy) / ((q.z - p.z) * (q.z - p.z)));
      }
      ratios_.push_back(std::sqrt(least));
    }
  }

  [[nodiscard]] double at(int i, int j) const {
    return ratios_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
  }

 private:
  int width_;
  std::vector<double> ratios_;
};

void expect_bounds_hold(const Heightfield& heights, Wrap wrap, Subdivision by, const SampledCones& sampled) {
  const BoundRequest request{.heights = heights, .wrap = wrap, .by = by, .threads = 1};
  const FineRatios lower = lower_cone_bounds(request);
  const FineRatios upper = upper_cone_bounds(request);
  const int step_x = kPerTexel / by.x;
  const int step_y = kPerTexel / by.y;
  for (int y = 0; y < lower.height; ++y) {
    for (int x = 0; x < lower.width; ++x) {
      for (int j = 0; j < step_y; ++j)
        for (int i = 0; i < step_x; ++i)
          ASSERT_LE(lower.at(x, y), sampled.at(x * step_x + i, y * step_y + j) * (1 + 1e-12));
      ASSERT_LE(std::min(1.0, sampled.at(x * step_x, y * step_y)), upper.at(x, y) * (1 + 1e-12));
    }
  }
}

TEST(ConeBounds, HoldTheRatiosOfAllPointsBetweenThem) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const MapSize size : {MapSize{6, 5}, MapSize{7, 3}}) {
      const Heightfield heights = map.make(size.width, size.height);
      for (const Wrap wrap : kWraps) {
        const SampledCones sampled(heights, wrap, 1);
        for (const Subdivision by : {Subdivision{}, Subdivision{.x = 2, .y = 4}, Subdivision{.x = 4, .y = 8}}) {
          SCOPED_TRACE(fmt::format("{} {}x{} by {} {}", map.id, size.width, size.height, by.x,
                                   wrap == Wrap::repeat ? "repeat" : "clamp"));
          if (size.width < 2 * size.height && by.x != by.y) continue;  // aspects that subdivision() does not make
          expect_bounds_hold(heights, wrap, by, sampled);
        }
        if (size.width < 2 * size.height) expect_bounds_hold(heights, wrap, {.x = 4, .y = 4}, sampled);
      }
    }
  }
}

TEST(ConeBounds, GrowTighterOnFinerGrids) {
  for (const auto make : {fbm_map, bricks_map, noise_map, pyramids_map}) {
    const Heightfield heights = make(24, 24);
    double proved = 0;
    FineRatios coarser;
    for (const int k : {1, 2, 4}) {
      const BoundRequest request{.heights = heights, .by = subdivision(24, 24, k), .threads = 1};
      const FineRatios lower = lower_cone_bounds(request);
      const double better = std::accumulate(lower.ratios.begin(), lower.ratios.end(), 0.0) / (24.0 * 24 * k * k);
      EXPECT_GT(better, 1.01 * proved) << "k = " << k;
      proved = better;
      // The points of the coarser grid are among the finer one's.
      FineRatios upper = upper_cone_bounds(request);
      for (int j = 0; j < coarser.height; ++j)
        for (int i = 0; i < coarser.width; ++i)
          ASSERT_LE(upper.at(2 * i, 2 * j), coarser.at(i, j) * 1.0001) << "k = " << k;
      coarser = std::move(upper);
    }
  }
}

TEST(ConeBounds, CellsKeepWhatWasProvedOfTheirParent) {
  const FineRatios coarser{.width = 2, .height = 1, .ratios = {0.5F, 0.125F}};
  FineRatios finer{.width = 4, .height = 2, .ratios = {0.25F, 0.75F, 0.25F, 0, 0.5F, 0.5F, 0.125F, 1}};
  keep_coarser(finer, coarser);
  EXPECT_EQ(finer.ratios, (std::vector<float>{0.5F, 0.75F, 0.25F, 0.125F, 0.5F, 0.5F, 0.125F, 1}));
}

TEST(ConeBounds, OfAFlatMapAreTheWidestCone) {
  for (const float max_ratio : {1.0F, 4.0F}) {
    const BoundRequest request{
        .heights = constant_map(4, 4), .by = subdivision(4, 4, 4), .max_ratio = max_ratio, .threads = 1};
    for (const float ratio : lower_cone_bounds(request).ratios) EXPECT_EQ(ratio, max_ratio);
    for (const float ratio : upper_cone_bounds(request).ratios) EXPECT_TRUE(std::isinf(ratio));
  }
}

TEST(ConeBounds, RefuseMapsWithoutCells) {
  EXPECT_THROW((void)lower_cone_bounds({.heights = constant_map(1, 8)}), Error);
  EXPECT_THROW((void)upper_cone_bounds({.heights = constant_map(8, 1)}), Error);
}

TEST(FineGrid, IsTheSurfaceAndItsTexels) {
  for (const Wrap wrap : kWraps) {
    const Heightfield heights = noise_map(7, 5);
    const Subdivision by{.x = 4, .y = 2};
    const Heightfield fine = refine(heights, wrap, by);
    ASSERT_EQ(fine.width, wrap == Wrap::repeat ? 28 : 25);
    ASSERT_EQ(fine.height, wrap == Wrap::repeat ? 10 : 9);
    for (int j = 0; j < fine.height; ++j) {
      for (int i = 0; i < fine.width; ++i) {
        const double under = slow_surface(heights, wrap, i / 4.0, j / 2.0) - fine.at(i, j);
        EXPECT_GE(under, 0);
        EXPECT_LT(under, 0x1p-24);
      }
    }
    for (int y = 0; y < heights.height; ++y)
      for (int x = 0; x < heights.width; ++x) EXPECT_EQ(fine.at(4 * x, 2 * y), heights.at(x, y));
  }
}

TEST(FineGrid, HasNearlySquareCells) {
  EXPECT_EQ(subdivision(64, 16, 1), (Subdivision{.x = 1, .y = 1}));
  EXPECT_EQ(subdivision(64, 16, 2), (Subdivision{.x = 2, .y = 8}));
  EXPECT_EQ(subdivision(24, 16, 4), (Subdivision{.x = 4, .y = 8}));
  EXPECT_EQ(subdivision(403, 344, 8), (Subdivision{.x = 8, .y = 8}));
  EXPECT_TRUE(is_affordable(16384, 16384, {}));
  EXPECT_TRUE(is_affordable(512, 512, {.x = 8, .y = 8}));
  EXPECT_FALSE(is_affordable(513, 512, {.x = 8, .y = 8}));
}

}  // namespace
}  // namespace reliefbench
