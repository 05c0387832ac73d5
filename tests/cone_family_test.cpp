// The quick and the quad cone maps, against their definitions.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "tests/cone_requests.h"
#include "tests/slow_cone_map.h"

namespace reliefbench {
namespace {

/// The greatest factor by which a ratio is over its limit; at most 1: none is.
double worst_factor(const std::vector<float>& ratios, const std::vector<float>& limits) {
  double worst = 0;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    worst = std::max(worst, static_cast<double>(ratios[i]) / static_cast<double>(limits[i]));
  }
  return worst;
}

TEST(QuickConeMap, IsThePseudoCodeOverSetsOfTexels) {
  for_each_request({{2, 2}, {2, 7}, {3, 3}, {8, 8}, {9, 5}, {13, 11}}, [](const BakeRequest& request) {
    EXPECT_EQ(bake_quick_naive(request), corrected(slow_quick(request, 1), request));
    EXPECT_EQ(bake_quick(request), corrected(slow_quick(request, 2), request));
  });
}

RC_GTEST_PROP(QuickConeMapProperty, IsThePseudoCodeOverSetsOfTexels, ()) {
  const Heightfield heights = random_map(20);
  const BakeRequest request = random_request(heights);
  RC_ASSERT(bake_quick_naive(request) == corrected(slow_quick(request, 1), request));
  RC_ASSERT(bake_quick(request) == corrected(slow_quick(request, 2), request));
}

TEST(QuickConeMap, NaiveIsAtMostQuickIsAtMostExact) {
  for_each_request({{32, 32}, {33, 20}, {45, 9}, {37, 41}, {129, 64}}, [](const BakeRequest& request) {
    const auto naive = bake_quick_naive(request);
    const auto quick = bake_quick(request);
    EXPECT_LE(worst_factor(naive, quick), 1);
    EXPECT_LE(worst_factor(quick, bake_conservative(request)), 1);
  });
}

TEST(QuickConeMap, ThreadsAndBoundChangeNothingElse) {
  const Heightfield heights = fbm_map(70, 101);
  for (const auto bake : {bake_quick_naive, bake_quick, bake_quick_published, bake_quick_centre}) {
    EXPECT_EQ(bake({.heights = heights, .threads = 2}), bake({.heights = heights, .threads = 1}));
    std::vector<float> bounded = bake({.heights = heights, .max_ratio = kUnboundedRatio, .threads = 1});
    EXPECT_GT(*std::ranges::max_element(bounded), 1);
    for (float& ratio : bounded) ratio = std::min(ratio, 1.0F);
    EXPECT_EQ(bake({.heights = heights, .threads = 1}), bounded);
  }
}

// Measured here: published up to 1.387 times, on 1.2 % of the texels; centre up to 1.96 times, on 32 %.
TEST(QuickConeMap, PublishedCornersAndCentresAreTooWideOnSpikes) {
  const Heightfield spikes = spikes_map(256, 256);
  const BakeRequest request{.heights = spikes, .wrap = Wrap::clamp, .threads = 1};
  const auto exact = bake_conservative(request);
  EXPECT_GT(worst_factor(bake_quick_published(request), exact), 1.38);
  EXPECT_GT(worst_factor(bake_quick_centre(request), exact), 1.9);
}

std::vector<float> slow_quad(const BakeRequest& request) {
  std::vector<float> quads(4 * request.heights.texels.size());
  constexpr int kAxes[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto ratios = corrected(slow_sector(request, kAxes[k][0], kAxes[k][1]), request);
    for (std::size_t i = 0; i < ratios.size(); ++i) quads[4 * i + k] = ratios[i];
  }
  return quads;
}

TEST(QuadConeMap, HasTheBitsOfAllPairs) {
  for_each_request({{2, 2}, {5, 3}, {3, 9}, {12, 12}, {11, 10}},
                   [](const BakeRequest& request) { EXPECT_EQ(bake_quad(request), slow_quad(request)); });
}

RC_GTEST_PROP(QuadConeMapProperty, HasTheBitsOfAllPairs, ()) {
  const Heightfield heights = random_map(11);
  const BakeRequest request = random_request(heights);
  RC_ASSERT(bake_quad(request) == slow_quad(request));
}

TEST(QuadConeMap, TheNarrowestOfTheFourIsTheConservativeCone) {
  for (const ConeTestMap& map : kConeTestMaps) {
    const Heightfield heights = map.make(40, 33);
    for (const Wrap wrap : kWraps) {
      SCOPED_TRACE(label(map.id, heights, wrap));
      const BakeRequest request{.heights = heights, .wrap = wrap, .threads = 2};
      const auto quads = bake_quad(request);
      std::vector<float> least;
      for (std::size_t i = 0; i < quads.size(); i += 4) {
        least.push_back(*std::min_element(quads.begin() + static_cast<std::ptrdiff_t>(i),
                                          quads.begin() + static_cast<std::ptrdiff_t>(i + 4)));
      }
      EXPECT_EQ(least, bake_conservative(request));
    }
  }
}

int surface_points_in_quads(const Heightfield& map, const std::vector<float>& quads, Wrap wrap) {
  std::vector<Heightfield> cones(4, map);
  for (std::size_t i = 0; i < quads.size(); ++i) cones[i % 4].texels[i / 4] = quads[i];
  return surface_points_in_sectors(map, cones, wrap, [](double du, double dv) {
    const bool along_u = std::abs(dv) <= std::abs(du);
    return along_u ? (du > 0 ? 0 : 1) : (dv > 0 ? 2 : 3);
  });
}

TEST(QuadConeMap, SafeConesNeverMeetTheInterpolatedSurface) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const auto& [width, height] : {MapSize{8, 8}, MapSize{9, 7}, MapSize{4, 10}}) {
      const Heightfield heights = map.make(width, height);
      for (const Wrap wrap : kWraps)
        for (const Correction correction : {Correction::safe, Correction::certified}) {
          const auto quads = bake_quad({.heights = heights, .wrap = wrap, .correction = correction, .threads = 1});
          EXPECT_EQ(surface_points_in_quads(heights, quads, wrap), 0) << label(map.id, heights, wrap, correction);
        }
    }
  }
  // That this can fail: cones of the texels alone are too wide between them.
  const Heightfield noise = noise_map(8, 8);
  const auto plain = bake_quad({.heights = noise, .correction = Correction::none, .threads = 1});
  EXPECT_GT(surface_points_in_quads(noise, plain, Wrap::repeat), 0);
}

// A border's texels go on beside a clamped map, as ridges: rays meet them at offsets that no texel of the map has.
TEST(QuadConeMap, SafeConesSeeWhatTheBorderGoesOnAs) {
  const Heightfield spike = make_map(12, 12, [](int x, int y) { return x == 11 && y == 8 ? 1.0F : 0.0F; });
  const BakeRequest request{.heights = spike, .wrap = Wrap::clamp, .correction = Correction::safe, .threads = 1};
  EXPECT_EQ(surface_points_in_quads(spike, bake_quad(request), Wrap::clamp), 0);
  // That this can fail: as if there were nothing beside the map.
  std::vector<float> unaware(4 * spike.texels.size());
  for (std::size_t k = 0; k < kQuadWedges.size(); ++k) {
    const ConeSearch seen{.heights = spike,
                          .wrap = Wrap::clamp,
                          .metric = cone_metric(12, 12, Correction::safe),
                          .views = {wedge_view(spike, 12, 12, kQuadWedges[k], kQuadWedges[k].safe_margin)},
                          .threads = 1};
    const auto ratios = corrected(search_cones(seen), request);
    for (std::size_t i = 0; i < ratios.size(); ++i) unaware[4 * i + k] = ratios[i];
  }
  EXPECT_GT(surface_points_in_quads(spike, unaware, Wrap::clamp), 0);
}

TEST(QuadConeMap, ASpikeBoundsTheConeThatFacesItAlone) {
  const Heightfield map = make_map(16, 16, [](int x, int y) { return x == 10 && y == 8 ? 1.0F : 0.0F; });
  const auto quads = bake_quad({.heights = map, .wrap = Wrap::clamp, .threads = 1});
  const auto at = [&](int x, int y) { return &quads[4 * (static_cast<std::size_t>(y) * 16 + x)]; };
  EXPECT_EQ(std::vector<float>(at(6, 8), at(6, 8) + 4), (std::vector<float>{4.0F / 16, 1, 1, 1}));
  EXPECT_EQ(std::vector<float>(at(10, 11), at(10, 11) + 4), (std::vector<float>{1, 1, 1, 3.0F / 16}));
  const float diagonal = std::nextafter(std::sqrt(2.0F) * 2 / 16, 0.0F);
  EXPECT_NEAR(at(12, 10)[1], diagonal, 1e-7);
  EXPECT_NEAR(at(12, 10)[3], diagonal, 1e-7);
}

}  // namespace
}  // namespace reliefbench
