// Structural similarity, tile by tile, vectorised. In float, but for the sums of the kernel; lumas are taken about the
// middle of their range, since variances are small differences of large squares.
#include <algorithm>
#include <numeric>

#include "kernels/base/prefetch.h"
#include "kernels/judge/picture_metrics.h"
#include "kernels/judge/tiles.h"

#ifndef RELIEFBENCH_SSIM_CONSTANTS
#define RELIEFBENCH_SSIM_CONSTANTS
namespace reliefbench {
namespace {
constexpr int kSsimRadius = 5;
constexpr double kSsimSigma = 1.5;
constexpr float kMiddle = 128;
constexpr float kC1 = (0.01F * 255) * (0.01F * 255);
constexpr float kC2 = (0.03F * 255) * (0.03F * 255);
}  // namespace
}  // namespace reliefbench
#endif

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/judge/ssim.cpp"  // NOLINT(bugprone-macro-parentheses)
// In this order:
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "kernels/judge/tile_filter-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {

int mirrored(int i, int n) {
  const int period = 2 * n;
  const int j = ((i % period) + period) % period;
  return j < n ? j : period - 1 - j;
}

/// Luma about the middle (Rec. 601) of a tile and its border of the kernel's radius.
void fill_luma(std::span<const std::uint8_t> rgba8, int width, int height, const Tile& tile, TilePlane& plane) {
  plane.resize(tile.width + 2 * kSsimRadius, tile.height + 2 * kSsimRadius);
  std::vector<int> columns(static_cast<std::size_t>(plane.width));
  for (std::size_t x = 0; x < columns.size(); ++x)
    columns[x] = mirrored(tile.x + static_cast<int>(x) - kSsimRadius, width);
  std::vector<std::uint32_t> pixels(columns.size());
  for (int y = 0; y < plane.height; ++y) {
    const auto line = static_cast<std::size_t>(mirrored(tile.y + y - kSsimRadius, height));
    const std::uint8_t* const from = rgba8.data() + 4 * line * static_cast<std::size_t>(width);
    prefetch_all(from + std::size_t{4} * static_cast<std::size_t>(columns[0]), 4 * static_cast<std::size_t>(width),
                 4 * columns.size());
    take_pixels(from, columns, pixels.data());
    float* const row = plane.row(y);
    for (std::size_t x = 0; x < pixels.size(); ++x)
      row[x] = 0.299F * channel_of(pixels[x], 0) + 0.587F * channel_of(pixels[x], 1) +
               0.114F * channel_of(pixels[x], 2) - kMiddle;
  }
}

struct SsimScratch {
  TilePlane a, b, product, rows;
  TilePlane mean_a, mean_b, mean_aa, mean_bb, mean_ab;
};

void mean_of_product(const TilePlane& a, const TilePlane& b, const std::vector<float>& kernel, SsimScratch& scratch,
                     TilePlane& out) {
  const hn::ScalableTag<float> tag;
  scratch.product.resize(a.width, a.height);
  for (std::size_t i = 0; i + hn::Lanes(tag) <= a.size(); i += hn::Lanes(tag))
    hn::StoreU(hn::Mul(hn::LoadU(tag, a.data() + i), hn::LoadU(tag, b.data() + i)), tag, scratch.product.data() + i);
  along_both(scratch.product, kernel, kernel, kSsimRadius, scratch.rows, out);
}

/// values: of the tile, rows a stride apart
void ssim_tile(const PicturePair& pictures, const std::vector<float>& kernel, const Tile& tile, float* values,
               std::size_t stride) {
  const hn::ScalableTag<float> tag;
  const int lanes = static_cast<int>(hn::Lanes(tag));
  static thread_local SsimScratch s;
  fill_luma(pictures.reference, pictures.width, pictures.height, tile, s.a);
  fill_luma(pictures.test, pictures.width, pictures.height, tile, s.b);
  along_both(s.a, kernel, kernel, kSsimRadius, s.rows, s.mean_a);
  along_both(s.b, kernel, kernel, kSsimRadius, s.rows, s.mean_b);
  mean_of_product(s.a, s.a, kernel, s, s.mean_aa);
  mean_of_product(s.b, s.b, kernel, s, s.mean_bb);
  mean_of_product(s.a, s.b, kernel, s, s.mean_ab);
  const auto two = hn::Set(tag, 2.0F);
  const auto c1 = hn::Set(tag, kC1);
  const auto c2 = hn::Set(tag, kC2);
  for (int y = 0; y < tile.height; ++y) {
    float* const out = values + static_cast<std::size_t>(y) * stride;
    HWY_ALIGN float last[HWY_MAX_BYTES / sizeof(float)];
    for (int x = 0; x < tile.width; x += lanes) {
      const auto at = [&](const TilePlane& plane) { return hn::LoadU(tag, plane.row(y) + x); };
      const auto da = at(s.mean_a);
      const auto db = at(s.mean_b);
      const auto variances = hn::Sub(hn::Add(at(s.mean_aa), at(s.mean_bb)), hn::Add(hn::Mul(da, da), hn::Mul(db, db)));
      const auto covariance = hn::Sub(at(s.mean_ab), hn::Mul(da, db));
      const auto ma = hn::Add(da, hn::Set(tag, kMiddle));
      const auto mb = hn::Add(db, hn::Set(tag, kMiddle));
      const auto above = hn::Mul(hn::Add(hn::Mul(two, hn::Mul(ma, mb)), c1), hn::Add(hn::Mul(two, covariance), c2));
      const auto below = hn::Mul(hn::Add(hn::Add(hn::Mul(ma, ma), hn::Mul(mb, mb)), c1), hn::Add(variances, c2));
      const auto value = hn::Div(above, below);
      if (x + lanes <= tile.width) {
        hn::StoreU(value, tag, out + x);
      } else {
        hn::Store(value, tag, last);
        std::copy_n(last, tile.width - x, out + x);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace reliefbench {
HWY_EXPORT(ssim_tile);

namespace {

/// Calls use(fill), where fill(tile, values, stride) makes the similarity of a tile.
template <typename Use>
auto with_ssim(const PicturePair& pictures, const Use& use) {
  const std::vector<double> bell = gaussian(kSsimSigma, kSsimRadius);
  const std::vector<float> kernel = scaled(bell, 1 / std::accumulate(bell.begin(), bell.end(), 0.0));
  return use([&](const Tile& tile, float* values, std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(ssim_tile)(pictures, kernel, tile, values, stride);
  });
}

}  // namespace

std::vector<float> ssim_map(const PicturePair& pictures) {
  return with_ssim(pictures, [&](const auto& fill) { return map_of_tiles(pictures.width, pictures.height, fill); });
}

std::optional<double> ssim_mean(const PicturePair& pictures, const RayMask& mask) {
  return with_ssim(pictures, [&](const auto& fill) {
    return mean_of_tiles(pictures.width, pictures.height, mask, fill).value_or(1);
  });
}

}  // namespace reliefbench
#endif  // HWY_ONCE
