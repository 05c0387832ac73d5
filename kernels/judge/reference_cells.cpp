// What the exact tracer knows of its cells, for those that walk on other ways than straight lines.
#include <algorithm>
#include <array>
#include <bit>

#include "kernels/judge/reference.h"

namespace reliefbench {

/// As corners_ counts them.
int ReferenceTracer::padded(std::int64_t cell, int side, int cells) const {
  if (wrap_ == Wrap::clamp) return static_cast<int>(std::clamp<std::int64_t>(cell + 1, 0, cells - 1));
  const std::int64_t rest = cell % side;
  return static_cast<int>(rest < 0 ? rest + side : rest);
}

ReferenceTracer::Corners ReferenceTracer::corners(std::int64_t x, std::int64_t y) const {
  const std::size_t stride = static_cast<std::size_t>(cells_x_) + 1;
  const float* row = &corners_[static_cast<std::size_t>(padded(y, height_, cells_y_)) * stride +
                               static_cast<std::size_t>(padded(x, width_, cells_x_))];
  return {row[0], row[1], row[stride], row[stride + 1]};
}

ReferenceTracer::HeightRange ReferenceTracer::height_range(std::int64_t x0, std::int64_t y0, std::int64_t x1,
                                                           std::int64_t y1) const {
  if (x1 - x0 >= width_ || y1 - y0 >= height_) return height_range();
  if (x0 == x1 && y0 == y1) return corners(x0, y0).range();
  // One or two spans along each axis, where the map's edge is crossed.
  struct Span {
    int first, last;
  };
  const auto spans = [&](std::int64_t from, std::int64_t to, int side, int cells) {
    const Span whole{padded(from, side, cells), padded(to, side, cells)};
    if (whole.first <= whole.last) return std::array{whole, Span{1, 0}};
    return std::array{Span{whole.first, cells - 1}, Span{0, whole.last}};
  };
  HeightRange range{1e30, -1e30};
  const auto span = static_cast<std::uint64_t>(std::max(x1 - x0, y1 - y0));
  const int level = std::clamp(static_cast<int>(std::bit_width(span)), 1, static_cast<int>(levels_.size()) - 1);
  const Level& nodes = levels_[static_cast<std::size_t>(level)];
  for (const Span& rows : spans(y0, y1, height_, cells_y_))
    for (const Span& columns : spans(x0, x1, width_, cells_x_))
      for (int y = rows.first >> level; rows.first <= rows.last && y <= rows.last >> level; ++y)
        for (int x = columns.first >> level; columns.first <= columns.last && x <= columns.last >> level; ++x) {
          const Bounds& bounds = nodes.nodes[static_cast<std::size_t>(y) * static_cast<std::size_t>(nodes.width) +
                                             static_cast<std::size_t>(x)];
          range = {std::min(range.min, static_cast<double>(bounds.min)),
                   std::max(range.max, static_cast<double>(bounds.max))};
        }
  return range;
}

}  // namespace reliefbench
