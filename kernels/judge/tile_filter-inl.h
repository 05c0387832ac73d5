// Separable correlation of a tile, once for every x86 level (Highway's foreach_target). No include guard of the usual
// kind: each level includes this anew.
#if defined(RELIEFBENCH_TILE_FILTER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RELIEFBENCH_TILE_FILTER_INL_H
#undef RELIEFBENCH_TILE_FILTER_INL_H
#else
#define RELIEFBENCH_TILE_FILTER_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A float plane of `width` x `height` whose rows may be read and written four vectors past their end.
struct TilePlane {
  int width = 0;
  int height = 0;
  std::size_t stride = 0;
  std::vector<float> values{};

  void resize(int new_width, int new_height) {
    constexpr std::size_t kSlack = 4 * 16 + 64;  // four of the widest vectors; and a kernel's length
    width = new_width;
    height = new_height;
    stride = static_cast<std::size_t>(new_width) + kSlack;
    values.resize(stride * static_cast<std::size_t>(new_height) + kSlack);
  }
  [[nodiscard]] float* row(int y) { return values.data() + stride * static_cast<std::size_t>(y); }
  [[nodiscard]] const float* row(int y) const { return values.data() + stride * static_cast<std::size_t>(y); }
};

/// A row of weighted sums: out[x] = sum over k of weights[k] in[x + k step]. Four vectors at once, so that a weight is
/// fetched once for them.
HWY_INLINE void weighted_row(const float* in, std::size_t step, const std::vector<float>& weights, int width,
                             float* out) {
  const hn::ScalableTag<float> tag;
  const std::size_t lanes = hn::Lanes(tag);
  for (std::size_t x = 0; x < static_cast<std::size_t>(width); x += 4 * lanes) {
    auto sum0 = hn::Zero(tag);
    auto sum1 = sum0;
    auto sum2 = sum0;
    auto sum3 = sum0;
    const float* from = in + x;
    for (const float value : weights) {
      const auto weight = hn::Set(tag, value);
      sum0 = hn::MulAdd(weight, hn::LoadU(tag, from), sum0);
      sum1 = hn::MulAdd(weight, hn::LoadU(tag, from + lanes), sum1);
      sum2 = hn::MulAdd(weight, hn::LoadU(tag, from + 2 * lanes), sum2);
      sum3 = hn::MulAdd(weight, hn::LoadU(tag, from + 3 * lanes), sum3);
      from += step;
    }
    hn::StoreU(sum0, tag, out + x);
    hn::StoreU(sum1, tag, out + x + lanes);
    hn::StoreU(sum2, tag, out + x + 2 * lanes);
    hn::StoreU(sum3, tag, out + x + 3 * lanes);
  }
}

/// Where a kernel's first weight lies in a border that it need not fill.
HWY_INLINE int before(const std::vector<float>& weights, int border) {
  return border - static_cast<int>(weights.size() / 2);
}

/// out(x, y) = sum over k of weights[k] in(x + border - radius + k, y): narrower than `in` by its border, as high.
HWY_INLINE void along_rows(const TilePlane& in, const std::vector<float>& weights, int border, TilePlane& out) {
  out.resize(in.width - 2 * border, in.height);
  for (int y = 0; y < out.height; ++y)
    weighted_row(in.row(y) + before(weights, border), 1, weights, out.width, out.row(y));
}

/// out(x, y) = sum over k of weights[k] in(x, y + border - radius + k): lower than `in` by its border, as wide.
HWY_INLINE void along_columns(const TilePlane& in, const std::vector<float>& weights, int border, TilePlane& out) {
  out.resize(in.width, in.height - 2 * border);
  for (int y = 0; y < out.height; ++y)
    weighted_row(in.row(y + before(weights, border)), in.stride, weights, out.width, out.row(y));
}

/// A kernel along x, then one along y, the rows between them in `rows`: smaller than `in` by its border on all sides.
HWY_INLINE void along_both(const TilePlane& in, const std::vector<float>& along_x, const std::vector<float>& along_y,
                           int border, TilePlane& rows, TilePlane& out) {
  along_rows(in, along_x, border, rows);
  along_columns(rows, along_y, border, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#endif  // RELIEFBENCH_TILE_FILTER_INL_H
