// LDR-FLIP, tile by tile, vectorised, in float. The plain form in double, by which it is tested, is
// tests/slow_picture_metrics.h.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "kernels/base/prefetch.h"
#include "kernels/judge/flip_eye.h"
#include "kernels/judge/picture_metrics.h"
#include "kernels/judge/tiles.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/judge/flip.cpp"  // NOLINT(bugprone-macro-parentheses)
// In this order:
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
#include "kernels/judge/tile_filter-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {

using Tag = hn::ScalableTag<float>;
using Vec = hn::Vec<Tag>;

HWY_INLINE Vec splat(double value) { return hn::Set(Tag{}, static_cast<float>(value)); }

/// base^power for base >= 0, power > 0.
HWY_INLINE Vec power_of(Vec base, Vec power) {
  const Tag tag;
  const Vec least = splat(1e-30);
  const Vec result = hn::Exp(tag, hn::Mul(power, hn::Log(tag, hn::Max(base, least))));
  return hn::IfThenElseZero(hn::Gt(base, least), result);
}

/// The cube root of t > 0, to 2 ulps: a third of the exponent and two of Halley's steps, each of which triples the
/// digits.
HWY_INLINE Vec cube_root(Vec t) {
  const Tag tag;
  const hn::RebindToSigned<Tag> bits;
  const Vec third = hn::Mul(hn::ConvertTo(tag, hn::BitCast(bits, t)), splat(1.0 / 3));
  Vec root = hn::BitCast(tag, hn::Add(hn::ConvertTo(bits, third), hn::Set(bits, 0x2a510000)));
  for (int step = 0; step < 2; ++step) {
    const Vec cube = hn::Mul(root, hn::Mul(root, root));
    root = hn::Mul(root, hn::Div(hn::MulAdd(splat(2), t, cube), hn::MulAdd(splat(2), cube, t)));
  }
  return root;
}

/// The function that CIELAB applies to a colour's share of white.
HWY_INLINE Vec lab_root(Vec t) {
  const Vec root = cube_root(hn::Max(t, splat(1e-30)));
  const Vec line = hn::MulAdd(t, splat(1 / (3 * kLabDelta * kLabDelta)), splat(4.0 / 29));
  return hn::IfThenElse(hn::Gt(t, splat(kLabDelta * kLabDelta * kLabDelta)), root, line);
}

HWY_INLINE Vec row_times(const FlipVec3& row, Vec x, Vec y, Vec z) {
  return hn::MulAdd(splat(row[0]), x, hn::MulAdd(splat(row[1]), y, hn::Mul(splat(row[2]), z)));
}

struct Lab {
  Vec lightness, a, b;
};

/// Hunt-adjusted CIELAB of a filtered YCxCz colour, brought back into what a screen can show.
HWY_INLINE Lab hunt_lab(Vec luma, Vec cx, Vec cz) {
  const Vec n1 = hn::Mul(hn::Add(luma, splat(16)), splat(1.0 / 116));
  const Vec x = hn::Mul(hn::MulAdd(cx, splat(1.0 / 500), n1), splat(kWhite[0]));
  const Vec z = hn::Mul(hn::NegMulAdd(cz, splat(1.0 / 200), n1), splat(kWhite[2]));
  const auto shown = [](Vec v) { return hn::Min(hn::Max(v, splat(0)), splat(1)); };
  const Vec red = shown(row_times(kRgbOfXyz[0], x, n1, z));
  const Vec green = shown(row_times(kRgbOfXyz[1], x, n1, z));
  const Vec blue = shown(row_times(kRgbOfXyz[2], x, n1, z));
  const auto share = [&](std::size_t i) {
    return lab_root(hn::Mul(row_times(kXyzOfRgb[i], red, green, blue), splat(1 / kWhite[i])));
  };
  const Vec fx = share(0);
  const Vec fy = share(1);
  const Vec fz = share(2);
  const Vec lightness = hn::MulAdd(splat(116), fy, splat(-16));
  return {lightness, hn::Mul(hn::Mul(lightness, splat(5)), hn::Sub(fx, fy)),
          hn::Mul(hn::Mul(lightness, splat(2)), hn::Sub(fy, fz))};
}

/// YCxCz of every sRGB code of every channel: a colour is the sum of its three.
class CodeTable {
 public:
  CodeTable() {
    for (std::size_t code = 0; code < 256; ++code) {
      const double value = static_cast<double>(code) / 255;
      const double linear = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto share = [&](std::size_t i) { return kXyzOfRgb[i][c] * linear / kWhite[i]; };
        entries_[c][code] = {static_cast<float>(116 * share(1) - (c == 0 ? 16 : 0)),
                             static_cast<float>(500 * (share(0) - share(1))),
                             static_cast<float>(200 * (share(1) - share(2)))};
      }
    }
  }
  [[nodiscard]] const std::array<float, 3>& at(std::size_t channel, std::uint8_t code) const {
    return entries_[channel][code];
  }

 private:
  std::array<std::array<std::array<float, 3>, 256>, 3> entries_{};
};

/// YCxCz of a tile with a border, edges replicated.
void fill_colors(std::span<const std::uint8_t> rgba8, int width, int height, const Tile& tile, int border,
                 std::array<TilePlane, 3>& planes) {
  static const CodeTable table;
  for (TilePlane& plane : planes) plane.resize(tile.width + 2 * border, tile.height + 2 * border);
  std::vector<std::size_t> columns(static_cast<std::size_t>(planes[0].width));
  for (std::size_t x = 0; x < columns.size(); ++x)
    columns[x] = 4 * static_cast<std::size_t>(std::clamp(tile.x + static_cast<int>(x) - border, 0, width - 1));
  for (int y = 0; y < planes[0].height; ++y) {
    const auto line = static_cast<std::size_t>(std::clamp(tile.y + y - border, 0, height - 1));
    const std::uint8_t* const from = rgba8.data() + 4 * line * static_cast<std::size_t>(width);
    prefetch_all(from + columns[0], 4 * static_cast<std::size_t>(width), 4 * columns.size());
    const std::array rows{planes[0].row(y), planes[1].row(y), planes[2].row(y)};
    for (std::size_t x = 0; x < columns.size(); ++x) {
      const auto& red = table.at(0, from[columns[x]]);
      const auto& green = table.at(1, from[columns[x] + 1]);
      const auto& blue = table.at(2, from[columns[x] + 2]);
      for (std::size_t c = 0; c < 3; ++c) rows[c][x] = red[c] + green[c] + blue[c];
    }
  }
}

/// A tile's features, planes of the tile's size; and what they are made of. A thread uses its own again and again.
struct TileFeatures {
  TilePlane lightness, a, b, edges, points;
  std::array<TilePlane, 3> colors;
  TilePlane belled, across, other, rows;
};

void add(const TilePlane& from, TilePlane& to) {
  const Tag tag;
  for (std::size_t i = 0; i + hn::Lanes(tag) <= to.size(); i += hn::Lanes(tag))
    hn::StoreU(hn::Add(hn::LoadU(tag, to.data() + i), hn::LoadU(tag, from.data() + i)), tag, to.data() + i);
}

void take_magnitude(const TilePlane& across, TilePlane& along) {
  const Tag tag;
  const Vec scale = splat(1.0 / 116);  // from Y to lightness; the kernels' sum is 0, so its offset does not matter
  for (std::size_t i = 0; i + hn::Lanes(tag) <= along.size(); i += hn::Lanes(tag)) {
    const Vec x = hn::LoadU(tag, along.data() + i);
    const Vec y = hn::LoadU(tag, across.data() + i);
    hn::StoreU(hn::Mul(scale, hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)))), tag, along.data() + i);
  }
}

void tile_features(std::span<const std::uint8_t> rgba8, int width, int height, const FlipEye& eye, const Tile& tile,
                   TileFeatures& out) {
  const Tag tag;
  fill_colors(rgba8, width, height, tile, eye.radius, out.colors);
  std::array<TilePlane*, 3> seen{&out.lightness, &out.a, &out.b};
  const auto filter = [&](const TilePlane& in, const FlipEye::Separable& kernel, TilePlane& result) {
    along_both(in, kernel.along_x, kernel.along_y, eye.radius, out.rows, result);
  };
  for (std::size_t c = 0; c < 3; ++c) filter(out.colors[c], eye.channels[c], *seen[c]);
  filter(out.colors[2], eye.blue_rest, out.other);
  add(out.other, out.b);
  for (int y = 0; y < tile.height; ++y)
    for (int x = 0; x < tile.width; x += static_cast<int>(hn::Lanes(tag))) {
      const Lab lab = hunt_lab(hn::LoadU(tag, out.lightness.row(y) + x), hn::LoadU(tag, out.a.row(y) + x),
                               hn::LoadU(tag, out.b.row(y) + x));
      hn::StoreU(lab.lightness, tag, out.lightness.row(y) + x);
      hn::StoreU(lab.a, tag, out.a.row(y) + x);
      hn::StoreU(lab.b, tag, out.b.row(y) + x);
    }
  along_rows(out.colors[0], eye.bell, eye.radius, out.belled);
  for (const auto& [kernel, result] : {std::pair(&eye.edge, &out.edges), std::pair(&eye.point, &out.points)}) {
    along_rows(out.colors[0], *kernel, eye.radius, out.other);
    along_columns(out.other, eye.bell, eye.radius, *result);
    along_columns(out.belled, *kernel, eye.radius, out.across);
    take_magnitude(out.across, *result);
  }
}

/// Stores the tile's part of a vector that may reach beyond its right edge.
HWY_INLINE void store_part(Vec value, float* out, int left) {
  const Tag tag;
  const auto lanes = static_cast<int>(hn::Lanes(tag));
  if (left >= lanes) {
    hn::StoreU(value, tag, out);
    return;
  }
  HWY_ALIGN float last[HWY_MAX_BYTES / sizeof(float)];
  hn::Store(value, tag, last);
  std::copy_n(last, left, out);
}

void flip_features_tile(std::span<const std::uint8_t> rgba8, int width, int height, const FlipEye& eye,
                        const Tile& tile, FlipFeatures& out) {
  static thread_local TileFeatures features;
  tile_features(rgba8, width, height, eye, tile, features);
  const std::pair<const TilePlane*, std::vector<float>*> planes[] = {{&features.lightness, &out.lightness},
                                                                     {&features.a, &out.a},
                                                                     {&features.b, &out.b},
                                                                     {&features.edges, &out.edges},
                                                                     {&features.points, &out.points}};
  for (const auto& [from, to] : planes)
    for (int y = 0; y < tile.height; ++y)
      std::copy_n(from->row(y), tile.width,
                  to->data() + static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(width) + tile.x);
}

/// values: of the tile, rows a stride apart
void flip_tile(const PicturePair& pictures, const FlipFeatures& reference, const FlipEye& eye, const Tile& tile,
               float* values, std::size_t stride) {
  const Tag tag;
  static thread_local TileFeatures test;
  tile_features(pictures.test, pictures.width, pictures.height, eye, tile, test);
  const double knee = kKneeAt * static_cast<double>(eye.greatest);
  for (int y = 0; y < tile.height; ++y) {
    const std::size_t line =
        first_pixel(tile, pictures.width) + static_cast<std::size_t>(y) * static_cast<std::size_t>(pictures.width);
    const std::size_t next_line = sizeof(float) * static_cast<std::size_t>(pictures.width);
    float* const row = values + static_cast<std::size_t>(y) * stride;
    // A row of the picture's last tile ends the planes: its last vector is read by parts.
    for (int x = 0; x < tile.width; x += static_cast<int>(hn::Lanes(tag))) {
      const std::size_t at = line + static_cast<std::size_t>(x);
      for (const std::vector<float>* plane :
           {&reference.lightness, &reference.a, &reference.b, &reference.edges, &reference.points})
        prefetch(plane->data() + at, next_line);
      const auto of_reference = [&](const std::vector<float>& plane) {
        if (at + hn::Lanes(tag) <= plane.size()) return hn::LoadU(tag, plane.data() + at);
        HWY_ALIGN float last[HWY_MAX_BYTES / sizeof(float)] = {};
        std::copy(plane.begin() + static_cast<std::ptrdiff_t>(at), plane.end(), last);
        return hn::Load(tag, last);
      };
      const auto of_test = [&](const TilePlane& plane) { return hn::LoadU(tag, plane.row(y) + x); };
      const auto apart = [&](const std::vector<float>& plane, const TilePlane& tested) {
        return hn::Sub(of_reference(plane), of_test(tested));
      };
      const Vec da = apart(reference.a, test.a);
      const Vec db = apart(reference.b, test.b);
      const Vec hyab =
          hn::Add(hn::Abs(apart(reference.lightness, test.lightness)), hn::Sqrt(hn::MulAdd(da, da, hn::Mul(db, db))));
      const Vec distance = power_of(hyab, splat(kDifferencePower));
      // Distances up to the knee take 95 % of the scale, the rest what is left.
      const Vec below = hn::Mul(distance, splat(kKneeValue / knee));
      const Vec above =
          hn::MulAdd(hn::Sub(distance, splat(knee)),
                     splat((1 - kKneeValue) / (static_cast<double>(eye.greatest) - knee)), splat(kKneeValue));
      const Vec color = hn::IfThenElse(hn::Lt(distance, splat(knee)), below, above);
      const Vec detail =
          hn::Max(hn::Abs(apart(reference.edges, test.edges)), hn::Abs(apart(reference.points, test.points)));
      const Vec feature = hn::Sqrt(hn::Mul(detail, splat(1 / std::numbers::sqrt2)));
      store_part(power_of(color, hn::Sub(splat(1), feature)), row + x, tile.width - x);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace reliefbench {
HWY_EXPORT(flip_features_tile);
HWY_EXPORT(flip_tile);

FlipFeatures flip_features(std::span<const std::uint8_t> rgba8, int width, int height, double pixels_per_degree) {
  const FlipEye eye = flip_eye(pixels_per_degree);
  FlipFeatures features;
  features.pixels_per_degree = pixels_per_degree;
  for (std::vector<float>* plane : {&features.lightness, &features.a, &features.b, &features.edges, &features.points})
    plane->resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_tile(width, height, [&](const Tile& tile) {
    HWY_DYNAMIC_DISPATCH(flip_features_tile)(rgba8, width, height, eye, tile, features);
  });
  return features;
}

namespace {

/// Calls use(fill), where fill(tile, values, stride) makes FLIP of a tile.
template <typename Use>
auto with_flip(const PicturePair& pictures, double pixels_per_degree, const Use& use) {
  FlipFeatures fresh;
  if (pictures.reference_features == nullptr)
    fresh = flip_features(pictures.reference, pictures.width, pictures.height, pixels_per_degree);
  const FlipFeatures& reference = pictures.reference_features == nullptr ? fresh : *pictures.reference_features;
  assert(reference.pixels_per_degree == pixels_per_degree);
  const FlipEye eye = flip_eye(pixels_per_degree);
  return use([&](const Tile& tile, float* values, std::size_t stride) {
    HWY_DYNAMIC_DISPATCH(flip_tile)(pictures, reference, eye, tile, values, stride);
  });
}

}  // namespace

std::vector<float> flip_map(const PicturePair& pictures, double pixels_per_degree) {
  return with_flip(pictures, pixels_per_degree,
                   [&](const auto& fill) { return map_of_tiles(pictures.width, pictures.height, fill); });
}

std::optional<double> flip_mean(const PicturePair& pictures, const RayMask& mask) {
  return with_flip(pictures, kPixelsPerDegree, [&](const auto& fill) {
    return mean_of_tiles(pictures.width, pictures.height, mask, fill).value_or(0);
  });
}

}  // namespace reliefbench
#endif  // HWY_ONCE
