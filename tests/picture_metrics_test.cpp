#include "kernels/judge/picture_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "kernels/judge/metric.h"
#include "kernels/judge/tiles.h"
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

/// Of which some pixels have a ray.
RayMask made_mask(std::size_t pixels, std::mt19937& random) {
  RayMask mask{.has_ray = UnfilledVector<std::uint8_t>(pixels)};
  for (std::uint8_t& one : mask.has_ray) {
    one = static_cast<std::uint8_t>(random() % 3 != 0);
    mask.count += one;
  }
  return mask;
}

TEST(TileMeans, LeavePixelsWithoutARayOut) {
  std::mt19937 random(1);
  for (const auto& [width, height] : {std::pair{1, 1}, {256, 64}, {257, 65}, {300, 190}, {9, 200}}) {
    const RayMask mask = made_mask(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), random);
    const auto value = [](int x, int y) { return static_cast<float>(x) + 0.25F * static_cast<float>(y); };
    double sum = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (mask.has_ray[static_cast<std::size_t>(y * width + x)] != 0) sum += static_cast<double>(value(x, y));
    const std::optional<double> mean =
        mean_of_tiles(width, height, mask, [&, width = width](const Tile& tile, float* values, std::size_t stride) {
          for (int y = 0; y < tile.height; ++y)
            for (int x = 0; x < tile.width; ++x)
              values[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)] =
                  mask.has_ray[first_pixel(tile, width) + static_cast<std::size_t>(y * width + x)] != 0
                      ? value(tile.x + x, tile.y + y)
                      : std::numeric_limits<float>::quiet_NaN();
        });
    ASSERT_EQ(mean.has_value(), mask.count > 0);
    if (mean) {
      EXPECT_NEAR(*mean, sum / static_cast<double>(mask.count), 1e-12 * (*mean + 1));
    }
  }
  EXPECT_FALSE(
      mean_of_tiles(1, 1, {.has_ray = UnfilledVector<std::uint8_t>(1, 0)}, [](const Tile&, float*, std::size_t) {}));
}

TEST(TileMeans, AreThoseOfTheMaps) {
  std::mt19937 random(2);
  constexpr int kMapWidth = 300;
  constexpr int kMapHeight = 90;
  constexpr std::size_t kCount = std::size_t{kMapWidth} * kMapHeight;
  std::vector<std::uint8_t> a(4 * kCount);
  std::vector<std::uint8_t> b(4 * kCount);
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i] = static_cast<std::uint8_t>(random());
    b[i] = static_cast<std::uint8_t>(a[i] ^ (random() & 31U));
  }
  const PicturePair pair{.reference = a, .test = b, .width = kMapWidth, .height = kMapHeight};
  const RayMask mask = made_mask(kCount, random);
  const auto mean = [&](const std::vector<float>& map) {
    double sum = 0;
    for (std::size_t i = 0; i < kCount; ++i) sum += mask.has_ray[i] * static_cast<double>(map[i]);
    return sum / static_cast<double>(mask.count);
  };
  EXPECT_NEAR(flip_mean(pair, mask).value(), mean(flip_map(pair)), 1e-12);
  EXPECT_NEAR(ssim_mean(pair, mask).value(), mean(ssim_map(pair)), 1e-12);
  std::int64_t squares = 0;
  std::int64_t wrong = 0;
  for (std::size_t i = 0; i < 4 * kCount; ++i) {
    if (mask.has_ray[i / 4] == 0) continue;
    if (i % 4 == 3)
      wrong += a[i] != b[i] ? 1 : 0;
    else
      squares += (a[i] - b[i]) * (a[i] - b[i]);
  }
  const auto pixels = static_cast<double>(mask.count);
  EXPECT_NEAR(psnr(pair, mask).value(), 10 * std::log10(65025 * 3 * pixels / static_cast<double>(squares)), 1e-9);
  EXPECT_EQ(wrong_visible(pair, mask).value(), static_cast<double>(wrong) / pixels);
}

TEST(Flicker, IsTheChangeOfTheErrorNotOfThePicture) {
  const std::vector<PixelScore> mask{{.e_xy = 0, .e_z = 0, .verdict = Verdict::good}, {}};
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
