#include "kernels/judge/picture_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "tests/slow_picture_metrics.h"

namespace reliefbench {
namespace {

constexpr int kWidth = 48;
constexpr int kHeight = 40;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

struct Pictures {
  std::vector<std::uint8_t> reference, test;
  [[nodiscard]] PicturePair pair() const {
    return {.reference = reference, .test = test, .width = kWidth, .height = kHeight};
  }
};

/// The pictures of tests/goldens/picture_metrics.py.
Pictures golden_pictures() {
  Pictures pictures;
  const auto push = [](std::vector<std::uint8_t>& to, int r, int g, int b) {
    for (const int value : {r % 256, g % 256, b, 255}) to.push_back(static_cast<std::uint8_t>(value));
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      push(pictures.reference, x * 5, y * 6, (x / 8 + y / 8) % 2 * 200);
      push(pictures.test, x * 5 + (x * y) % 23, y * 6, ((x + 1) / 8 + y / 8) % 2 * 200);
    }
  return pictures;
}

struct Golden {
  int x, y;
  double value;
};

void expect_golden(const std::vector<float>& map, double mean, const std::vector<Golden>& goldens, double tolerance) {
  ASSERT_EQ(map.size(), kPixels);
  EXPECT_NEAR(std::accumulate(map.begin(), map.end(), 0.0) / kPixels, mean, tolerance);
  for (const Golden& golden : goldens)
    EXPECT_NEAR(map[static_cast<std::size_t>(golden.y * kWidth + golden.x)], golden.value, tolerance)
        << golden.x << "," << golden.y;
}

// Values of tests/goldens/picture_metrics.py: the paper's equations with whole 2D kernels.
TEST(Flip, IsTheIndependentImplementations) {
  const Pictures pictures = golden_pictures();
  expect_golden(flip_map(pictures.pair()), 0.190878,
                {{0, 0, 0.034434}, {7, 7, 0.220072}, {20, 31, 0.129277}, {47, 39, 0.617379}, {30, 0, 0.223736}}, 2e-4);
}

/// Waves, blocks and noise; the test picture has a third of its columns as they are in the reference.
Pictures busy_pictures(int width, int height) {
  std::mt19937 random(7);
  Pictures pictures;
  for (int i = 0; i < 4 * width * height; ++i) {
    const int x = i / 4 % width;
    const int y = i / 4 / width;
    const int value = (x * (3 + i % 4) / 2 + y * 2 + (x / 9 + y / 7) % 2 * 90) % 256;
    const int noise = x / 5 % 3 == 0 ? 0 : static_cast<int>(random() % 61) - 30;
    pictures.reference.push_back(static_cast<std::uint8_t>(value));
    pictures.test.push_back(static_cast<std::uint8_t>(std::clamp(value + noise, 0, 255)));
  }
  return pictures;
}

// Sizes under a kernel's, across tiles' borders, and with rows that end within a vector.
TEST(PictureMetrics, VectorisedIsThePlainFormInDouble) {
  for (const auto& [width, height] : {std::pair(1, 1), {7, 5}, {23, 64}, {257, 65}, {300, 130}, {511, 129}}) {
    const Pictures pictures = busy_pictures(width, height);
    const PicturePair pair{.reference = pictures.reference, .test = pictures.test, .width = width, .height = height};
    const std::vector<float> flip = flip_map(pair);
    const std::vector<float> ssim = ssim_map(pair);
    const std::vector<float> slow_flip = slow::flip_map(pair, kPixelsPerDegree);
    const std::vector<float> slow_ssim = slow::ssim_map(pair);
    ASSERT_EQ(flip.size(), slow_flip.size());
    ASSERT_EQ(ssim.size(), slow_ssim.size());
    for (std::size_t i = 0; i < flip.size(); ++i) {
      EXPECT_NEAR(flip[i], slow_flip[i], 1e-4) << width << " x " << height << " at " << i;
      EXPECT_NEAR(ssim[i], slow_ssim[i], 1e-4) << width << " x " << height << " at " << i;
    }
  }
}

TEST(PictureMetrics, FeaturesMadeBeforeGiveTheSameBits) {
  const Pictures pictures = busy_pictures(300, 130);
  PicturePair pair{.reference = pictures.reference, .test = pictures.test, .width = 300, .height = 130};
  const std::vector<float> fresh = flip_map(pair);
  const FlipFeatures features = flip_features(pictures.reference, 300, 130);
  pair.reference_features = &features;
  EXPECT_EQ(flip_map(pair), fresh);
}

// Values of scikit-image.
TEST(Ssim, IsScikitImages) {
  const Pictures pictures = golden_pictures();
  expect_golden(ssim_map(pictures.pair()), 0.781066,
                {{0, 0, 0.997300}, {7, 7, 0.653860}, {20, 31, 0.875453}, {47, 39, 0.389286}, {30, 0, 0.599794}}, 2e-4);
}

TEST(Flip, BlackAgainstWhite) {
  const std::vector<std::uint8_t> black(kPixels * 4, 0);
  const std::vector<std::uint8_t> white(kPixels * 4, 255);
  const std::vector<float> map = flip_map({.reference = black, .test = white, .width = kWidth, .height = kHeight});
  for (const float value : map) EXPECT_NEAR(value, 0.967380, 1e-4);
}

TEST(PictureMetrics, EqualPicturesAreEqual) {
  Pictures pictures = golden_pictures();
  pictures.test = pictures.reference;
  for (const float value : flip_map(pictures.pair())) EXPECT_EQ(value, 0);
  for (const float value : ssim_map(pictures.pair())) EXPECT_NEAR(value, 1, 1e-6);
}

TEST(Flip, IsSymmetric) {
  const Pictures pictures = golden_pictures();
  const Pictures swapped{.reference = pictures.test, .test = pictures.reference};
  const std::vector<float> a = flip_map(pictures.pair());
  const std::vector<float> b = flip_map(swapped.pair());
  for (std::size_t i = 0; i < kPixels; ++i) EXPECT_NEAR(a[i], b[i], 1e-6);
}

TEST(MaskedMean, LeavesPixelsWithoutARayOut) {
  const std::vector<PixelScore> mask{{.verdict = Verdict::good}, {}, {.verdict = Verdict::missed}};
  EXPECT_EQ(masked_mean(std::vector{1.0F, 100.0F, 3.0F}, ray_mask(mask)), 2.0);
  EXPECT_FALSE(masked_mean(std::vector{1.0F}, ray_mask(std::vector<PixelScore>(1))).has_value());
}

TEST(Flicker, IsTheChangeOfTheErrorNotOfThePicture) {
  const std::vector<PixelScore> mask{{.verdict = Verdict::good}, {}};
  const std::vector<std::uint8_t> first{10, 20, 30, 255, 0, 0, 0, 255};
  const std::vector<std::uint8_t> second{40, 50, 60, 255, 90, 90, 90, 255};
  // The picture moves with its reference: no flicker.
  EXPECT_EQ(flicker({.picture = first, .reference = first, .mask = mask},
                    {.picture = second, .reference = second, .mask = mask}),
            0);
  // An error of 30 in every channel comes up.
  EXPECT_NEAR(flicker({.picture = first, .reference = first, .mask = mask},
                      {.picture = second, .reference = first, .mask = mask})
                  .value(),
              30.0 / 255, 1e-12);
  const std::vector<PixelScore> nothing(2);
  EXPECT_FALSE(flicker({.picture = first, .reference = first, .mask = nothing},
                       {.picture = second, .reference = second, .mask = mask})
                   .has_value());
}

}  // namespace
}  // namespace reliefbench
