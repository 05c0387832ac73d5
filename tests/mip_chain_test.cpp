#include "kernels/maps/mip_chain.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/maps/map_texture.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

/// The texels round a point of the unit square, and their weights.
struct Neighbours {
  std::array<std::size_t, 4> texels{};
  std::array<double, 4> weights{};
};

Neighbours neighbours(double u, double v, int width, int height, Wrap wrap) {
  const double x = u * width - 0.5;
  const double y = v * height - 0.5;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  Neighbours result;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto right = static_cast<int>(k % 2);
    const auto up = static_cast<int>(k / 2);
    result.texels.at(k) =
        static_cast<std::size_t>(wrapped(j + up, height, wrap) * width + wrapped(i + right, width, wrap));
    result.weights.at(k) = (right == 1 ? x - i : 1 - (x - i)) * (up == 1 ? y - j : 1 - (y - j));
  }
  return result;
}

double interpolated(const Neighbours& at, const std::vector<float>& values) {
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += at.weights.at(k) * double{values[at.texels.at(k)]};
  return sum;
}

/// Where an axis of n or m texels has its knots, and points between them; beyond both ends, too.
std::vector<double> axis_points(int n, int m) {
  std::vector<double> points;
  for (const int side : {n, m})
    for (int i = -1; i <= side; ++i)
      for (const double offset : {0.5, 0.7, 1.0, 1.499}) points.push_back((i + offset) / side);
  return points;
}

/// Calls check(fine neighbours, coarse neighbours) at many points.
template <typename Check>
void compare(const Heightfield& fine, const Heightfield& coarse, Wrap wrap, const Check& check) {
  for (const double v : axis_points(fine.height, coarse.height))
    for (const double u : axis_points(fine.width, coarse.width))
      check(neighbours(u, v, fine.width, fine.height, wrap), neighbours(u, v, coarse.width, coarse.height, wrap));
}

struct RandomMap {
  Heightfield heights;
  std::vector<float> ratios;
  Wrap wrap;
};

RandomMap random_chain_map() {
  const int width = *rc::gen::inRange(2, 13);
  const int height = *rc::gen::inRange(2, 13);
  const int seed = *rc::gen::arbitrary<int>();
  const Wrap wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp);
  const auto noise = [&](int offset) {
    return make_map(width, height, [&](int x, int y) { return 0.9F * lattice_noise(x + offset, y, seed); });
  };
  return {.heights = noise(0), .ratios = noise(99).texels, .wrap = wrap};
}

constexpr double kRounding = 1e-12;  // of this test's own sums

RC_GTEST_PROP(MipChain, CoarseSurfacesAreAboveAndCoarseConesWithin, ()) {
  const auto [heights, ratios, wrap] = random_chain_map();
  MipLevel fine{.heights = heights, .ratios = ratios};
  for (const MipLevel& coarse : mip_chain(heights, ratios, 1, wrap)) {
    compare(fine.heights, coarse.heights, wrap, [&](const Neighbours& near, const Neighbours& far) {
      RC_ASSERT(interpolated(far, coarse.heights.texels) >= interpolated(near, fine.heights.texels) - kRounding);
      RC_ASSERT(interpolated(far, coarse.ratios) <= interpolated(near, fine.ratios) + kRounding);
    });
    fine = coarse;
  }
  RC_ASSERT(fine.heights.width == 1);
  RC_ASSERT(fine.heights.height == 1);
  RC_ASSERT(fine.heights.texels.front() == std::ranges::max(heights.texels));
  RC_ASSERT(fine.ratios.front() == std::ranges::min(ratios));
}

// As stored, the coarse cones are within the base's cones as baked, whichever of its four texels counts.
RC_GTEST_PROP(MipChain, PackedConesAreWithinTheBakedOnes, ()) {
  const auto [raw, ratios, wrap] = random_chain_map();
  const Format& format =
      find_format(*rc::gen::element("rg8", "rg16", "rg16f", "rg32f", "r8+r8", "bc5", "eac_rg11", "bc7", "astc"));
  const Encoding& encoding = *rc::gen::elementOf(encodings());
  RC_PRE(format.type != TexelType::bc7 || !encoding.is_decreasing);
  const Heightfield heights = quantise_heights(raw, format.type);
  const MapTextures textures = pack_map({.map = find_map(MapKind::conservative),
                                         .heights = heights,
                                         .values = ratios,
                                         .wrap = wrap,
                                         .mips = Mips::conservative},
                                        format, encoding);
  const TextureImage& ratio_image = textures.extra ? *textures.extra : textures.relief;
  RC_ASSERT(ratio_image.levels == textures.relief.levels);
  for (int level = 1; level < textures.relief.levels; ++level) {
    const Heightfield coarse{.width = level_side(heights.width, level),
                             .height = level_side(heights.height, level),
                             .texels = read_channel(textures.relief, 0, level)};
    const std::vector<float> stored = read_channel(ratio_image, textures.extra ? 0 : 1, level);
    compare(heights, coarse, wrap, [&, &baked = ratios](const Neighbours& near, const Neighbours& far) {
      const double height = interpolated(far, coarse.texels);
      RC_ASSERT(height >= interpolated(near, heights.texels) - kRounding);
      float least = 1;
      for (std::size_t k = 0; k < 4; ++k)
        if (near.weights.at(k) > kRounding) least = std::min(least, baked[near.texels.at(k)]);
      const float decoded = encoding.decode(static_cast<float>(interpolated(far, stored)), static_cast<float>(height));
      RC_ASSERT(decoded <= least * 1.0001F);
    });
  }
}

// Of 8 texels, the 4th reaches over uv (3.5, 5.5) / 8, the coarse texel i over (i - 1/2, i + 3/2) / 4.
TEST(MipChain, ASpikeIsSeenAsFarAsItIsInterpolated) {
  const Heightfield spike = make_map(8, 2, [](int x, int) { return x == 4 ? 1.0F : 0.0F; });
  const std::vector<MipLevel> chain = mip_chain(spike, {}, 0, Wrap::clamp);
  EXPECT_THAT(chain.at(0).heights.texels, ::testing::ElementsAre(0, 1, 1, 1));
  const Heightfield edge = make_map(8, 2, [](int x, int) { return x == 0 ? 1.0F : 0.0F; });
  EXPECT_THAT(mip_chain(edge, {}, 0, Wrap::clamp).at(0).heights.texels, ::testing::ElementsAre(1, 1, 0, 0));
  EXPECT_THAT(mip_chain(edge, {}, 0, Wrap::repeat).at(0).heights.texels, ::testing::ElementsAre(1, 1, 0, 1));
}

// 7 texels become 3: no multiple, so that texel 4 is out of the first coarse texel's reach, uv (-1/2, 3/2) / 3.
TEST(MipChain, OddSidesAreCovered) {
  const auto spike = [](int at) { return make_map(7, 2, [at](int x, int) { return x == at ? 1.0F : 0.0F; }); };
  EXPECT_THAT(mip_chain(spike(3), {}, 0, Wrap::clamp).at(0).heights.texels, ::testing::ElementsAre(1, 1, 1));
  EXPECT_THAT(mip_chain(spike(4), {}, 0, Wrap::clamp).at(0).heights.texels, ::testing::ElementsAre(0, 1, 1));
}

TEST(MipChain, RatiosOfATexelStayApart) {
  const Heightfield heights = constant_map(2, 2);
  const std::vector<float> ratios{0.1F, 0.9F, 0.2F, 0.8F, 0.3F, 0.7F, 0.4F, 0.6F};
  EXPECT_THAT(mip_chain(heights, ratios, 2, Wrap::repeat).at(0).ratios, ::testing::ElementsAre(0.1F, 0.6F));
}

}  // namespace
}  // namespace reliefbench
