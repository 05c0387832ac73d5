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
#include <cstdint>
#include <cstring>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A float plane of `width` x `height` whose rows may be read and written four vectors past their end. Rows begin where
/// cache lines do: a vector that lies on two of them takes twice as long to read.
struct TilePlane {
  int width = 0;
  int height = 0;
  std::size_t stride = 0;

  void resize(int new_width, int new_height) {
    constexpr std::size_t kSlack = 4 * 16 + 64;  // four of the widest vectors; and a kernel's length
    width = new_width;
    height = new_height;
    stride = lines_for(static_cast<std::size_t>(new_width) + kSlack) * kLine;
    lines_.resize(lines_for(stride * static_cast<std::size_t>(new_height) + kSlack));
  }
  [[nodiscard]] std::size_t size() const { return lines_.size() * kLine; }  ///< of all rows, with what is behind them
  [[nodiscard]] float* data() { return lines_.data()->values; }
  [[nodiscard]] const float* data() const { return lines_.data()->values; }
  [[nodiscard]] float* row(int y) { return data() + stride * static_cast<std::size_t>(y); }
  [[nodiscard]] const float* row(int y) const { return data() + stride * static_cast<std::size_t>(y); }

 private:
  static constexpr std::size_t kLine = 16;
  struct alignas(kLine * sizeof(float)) Line {
    float values[kLine];
  };
  static constexpr std::size_t lines_for(std::size_t count) { return (count + kLine - 1) / kLine; }

  std::vector<Line> lines_{};
};

/// RGBA8 pixels, red lowest, of a line of a picture at these columns, which run on by one but for the picture's
/// borders.
HWY_INLINE void take_pixels(const std::uint8_t* line, const std::vector<int>& columns, std::uint32_t* out) {
  for (std::size_t x = 0; x < columns.size();) {
    std::size_t end = x + 1;
    while (end < columns.size() && columns[end] == columns[end - 1] + 1) ++end;
    std::memcpy(out + x, line + std::size_t{4} * static_cast<std::size_t>(columns[x]), 4 * (end - x));
    x = end;
  }
}
HWY_INLINE float channel_of(std::uint32_t pixel, int channel) {
  return static_cast<float>(static_cast<std::int32_t>(pixel >> (8 * channel) & 0xffU));
}

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
