#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"

// Where the elevation of the surface, seen from a surface point p, never falls along any line from p, a ray that starts
// over p meets the surface at most once: seen from p, the ray's own elevation never rises. For a point q of a bilinear
// cell with gradient g the elevation does not fall if
//   G(p, q) = (q - p) . g(q) >= 0 and H(q) >= H(p), or E(p, q) = G(p, q) - H(q) + H(p) >= 0
// (where the surface rises along the line, a ray that goes down meets it once, too). G and E are affine in each
// coordinate of q and, where p's own cell is fixed, of p: signs at the corners of cells are signs everywhere.
// For p between texels: where G >= 0 is asked only of cells that are over all the 3 x 3 texels round each corner of p's
// cell, either E >= 0 holds at the four of them, or G >= 0 does (E >= 0 and H(q) >= H(p) give G >= 0), and so it holds
// at p. A twisted cell is not harmless to all of its own four corners, so p then has radius 0. A cell that is harmful
// to p is so to a corner of p's cell, at most one diagonal from p: hence the 3 x 3 minimum, less a diagonal.

namespace reliefbench {
namespace {

constexpr int kLeastNode = 4;  // cells along the least node

struct Interval {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void add(const Interval& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
};

double least_product(const Interval& a, const Interval& b) {
  return std::min({a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high});
}

/// Heights and gradient (per texel) of a part of the surface.
struct Shape {
  Interval height, slope_x, slope_y;
  void add(const Shape& other) {
    height.add(other.height);
    slope_x.add(other.slope_x);
    slope_y.add(other.slope_y);
  }
  [[nodiscard]] bool is_flat() const {
    return slope_x.low == 0 && slope_x.high == 0 && slope_y.low == 0 && slope_y.high == 0;
  }
};

/// The point that a radius belongs to.
struct Owner {
  double x, y;  ///< in texels; half a texel outside a clamped map, or on a texel
  double height;
  double floor;  ///< cells that rise are harmless from this height on
};

/// The cells between texels; under clamp also those of the flat border, which cell -1 and the last one stand for.
class Cells {
 public:
  Cells(const Heightfield& heights, Wrap wrap) : heights_(heights), wrap_(wrap), border_(wrap == Wrap::clamp ? 1 : 0) {}

  [[nodiscard]] int first() const { return -border_; }
  [[nodiscard]] int columns() const { return heights_.width + border_; }
  [[nodiscard]] int rows() const { return heights_.height + border_; }

  /// The corners of a cell, in the order (0, 0), (1, 0), (0, 1), (1, 1), each with its own gradient.
  struct Corner {
    double height, slope_x, slope_y;
  };
  [[nodiscard]] std::array<Corner, 4> corners(int x, int y) const {
    const auto at = [&](int i, int j) -> double {
      return heights_.at(wrapped(x + i, heights_.width, wrap_), wrapped(y + j, heights_.height, wrap_));
    };
    const double h00 = at(0, 0);
    const double h10 = at(1, 0);
    const double h01 = at(0, 1);
    const double h11 = at(1, 1);
    return {{{h00, h10 - h00, h01 - h00},
             {h10, h10 - h00, h11 - h10},
             {h01, h11 - h01, h01 - h00},
             {h11, h11 - h01, h11 - h10}}};
  }

  [[nodiscard]] Shape shape(int x, int y) const {
    Shape shape;
    for (const auto& [height, slope_x, slope_y] : corners(x, y)) {
      shape.height.add(height);
      shape.slope_x.add(slope_x);
      shape.slope_y.add(slope_y);
    }
    return shape;
  }

 private:
  const Heightfield& heights_;
  Wrap wrap_;
  int border_;
};

/// (dx, dy): from the owner to the first texel of the cell, or of its image.
bool is_harmful(const std::array<Cells::Corner, 4>& corners, double dx, double dy, const Owner& owner) {
  bool rises = true;
  bool stays_in_sight = true;
  bool is_flat = true;
  for (int k = 0; k < 4; ++k) {
    const auto& [height, slope_x, slope_y] = corners[static_cast<std::size_t>(k)];
    const double gain = (dx + k % 2) * slope_x + (dy + (k >> 1)) * slope_y;
    rises = rises && gain >= 0 && height >= owner.floor;
    stays_in_sight = stays_in_sight && gain - height + owner.height >= 0;
    is_flat = is_flat && slope_x == 0 && slope_y == 0;
  }
  return !rises && !stays_in_sight && !is_flat;
}

/// What all cells of a node have, with the same roundings in the same order: a bound is never on the wrong side.
bool may_harm(const Shape& shape, const Interval& dx, const Interval& dy, const Owner& owner) {
  if (shape.is_flat()) return false;
  const double gain = least_product(dx, shape.slope_x) + least_product(dy, shape.slope_y);
  if (gain >= 0 && shape.height.low >= owner.floor) return false;
  return gain - shape.height.high + owner.height < 0;
}

/// Distance of 0 from cells first .. first + count - 1 along an axis, in texels.
double gap(double first, int count) { return std::max({first, -(first + count), 0.0}); }

class RadiusSearch {
 public:
  explicit RadiusSearch(const BakeRequest& request)
      : cells_(request.heights, request.wrap),
        metric_(cone_metric(request.heights.width, request.heights.height, Correction::none)) {
    if (request.wrap == Wrap::repeat) {
      tile_x_ = request.heights.width;
      tile_y_ = request.heights.height;
    }
    int columns = nodes_of(cells_.columns(), kLeastNode);
    int rows = nodes_of(cells_.rows(), kLeastNode);
    Level level{.columns = columns, .shapes = {}};
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) level.shapes.push_back(block_shape(x, y));
    }
    levels_.push_back(std::move(level));
    while (columns > 1 || rows > 1) {
      const Level& below = levels_.back();
      const int columns_below = columns;
      const int rows_below = rows;
      columns = nodes_of(columns, 2);
      rows = nodes_of(rows, 2);
      Level next{.columns = columns, .shapes = std::vector<Shape>(static_cast<std::size_t>(columns) * rows)};
      for (int y = 0; y < rows_below; ++y) {
        for (int x = 0; x < columns_below; ++x) next.at(x / 2, y / 2).add(below.at(x, y));
      }
      levels_.push_back(std::move(next));
    }
  }

  /// The squared distance to the nearest cell that is harmful to the owner; at most one uv, in the metric's unit.
  [[nodiscard]] double nearest(const Owner& owner) const {
    double best = metric_.side * metric_.side;
    for (const int j : {0, 1, -1}) {
      for (const int i : {0, 1, -1}) {
        if ((i != 0 && tile_x_ == 0) || (j != 0 && tile_y_ == 0)) continue;
        best = search(owner, cells_.first() + i * tile_x_ - owner.x, cells_.first() + j * tile_y_ - owner.y, best);
      }
    }
    return best;
  }

  [[nodiscard]] const ConeMetric& metric() const { return metric_; }

 private:
  struct Level {
    int columns;
    std::vector<Shape> shapes;
    [[nodiscard]] std::size_t index(int x, int y) const {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
    }
    [[nodiscard]] Shape& at(int x, int y) { return shapes[index(x, y)]; }
    [[nodiscard]] const Shape& at(int x, int y) const { return shapes[index(x, y)]; }
    [[nodiscard]] bool has(int x, int y) const { return x < columns && index(x, y) < shapes.size(); }
  };

  struct Node {
    int x, y, level;
  };

  static int nodes_of(int count, int per_node) { return (count + per_node - 1) / per_node; }

  [[nodiscard]] Shape block_shape(int x, int y) const {
    Shape shape;
    for_each_cell(x, y, [&](int i, int j) { shape.add(cells_.shape(cells_.first() + i, cells_.first() + j)); });
    return shape;
  }

  /// body(i, j) for the cells of a least node, counted from the first cell.
  template <class Body>
  void for_each_cell(int x, int y, const Body& body) const {
    for (int j = y * kLeastNode; j < std::min((y + 1) * kLeastNode, cells_.rows()); ++j) {
      for (int i = x * kLeastNode; i < std::min((x + 1) * kLeastNode, cells_.columns()); ++i) body(i, j);
    }
  }

  [[nodiscard]] double distance2(double dx, double dy) const {
    return dx * dx * metric_.weight_x + dy * dy * metric_.weight_y;
  }

  /// Branch and bound over one image; (dx, dy): from the owner to its first cell.
  [[nodiscard]] double search(const Owner& owner, double dx, double dy, double best) const {
    std::array<Node, 64> stack{};  // at most three nodes wait on each of 15 levels, and one is open
    std::size_t count = 0;
    stack[count++] = {0, 0, static_cast<int>(levels_.size()) - 1};
    while (count > 0) {
      const Node node = stack[--count];
      const int side = kLeastNode << node.level;
      const double x = dx + node.x * side;
      const double y = dy + node.y * side;
      if (distance2(gap(x, side), gap(y, side)) >= best) continue;
      const Shape& shape = levels_[static_cast<std::size_t>(node.level)].at(node.x, node.y);
      if (!may_harm(shape, {.low = x, .high = x + side}, {.low = y, .high = y + side}, owner)) continue;
      if (node.level == 0) {
        for_each_cell(node.x, node.y, [&](int i, int j) {
          const double found = distance2(gap(dx + i, 1), gap(dy + j, 1));
          if (found >= best) return;
          if (is_harmful(cells_.corners(cells_.first() + i, cells_.first() + j), dx + i, dy + j, owner)) best = found;
        });
        continue;
      }
      const int near_x = x + 0.5 * side <= 0 ? 1 : 0;
      const int near_y = y + 0.5 * side <= 0 ? 1 : 0;
      for (const int child : {3, 2, 1, 0}) {  // the near child is on top of the stack
        const Node next{.x = 2 * node.x + (near_x ^ (child & 1)),
                        .y = 2 * node.y + (near_y ^ (child >> 1)),
                        .level = node.level - 1};
        if (levels_[static_cast<std::size_t>(next.level)].has(next.x, next.y)) stack[count++] = next;
      }
    }
    return best;
  }

  Cells cells_;
  ConeMetric metric_;
  int tile_x_ = 0;  // texels from one image to the next; 0: there is one only
  int tile_y_ = 0;
  std::vector<Level> levels_;
};

double highest_neighbour(const Heightfield& heights, Wrap wrap, int x, int y) {
  float highest = 0;
  for (int j = y - 1; j <= y + 1; ++j) {
    for (int i = x - 1; i <= x + 1; ++i) {
      highest = std::max(highest, heights.at(wrapped(i, heights.width, wrap), wrapped(j, heights.height, wrap)));
    }
  }
  return highest;
}

/// Where rays that a texel's values are interpolated for may start: on it, and at the edge of uv half a texel outside.
std::vector<double> starts(int texel, int side, bool has_edge) {
  std::vector<double> all{static_cast<double>(texel)};
  if (has_edge && texel == 0) all.push_back(-0.5);
  if (has_edge && texel == side - 1) all.push_back(side - 0.5);
  return all;
}

/// Radii in uv.
std::vector<float> safe_radii(const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  const bool is_interpolated = request.correction != Correction::none;
  const bool has_edge = is_interpolated && request.wrap == Wrap::clamp;
  const RadiusSearch search(request);
  std::vector<float> radii(heights.texels.size());
  parallel_for(heights.height, request.threads, [&](int y) {
    for (int x = 0; x < heights.width; ++x) {
      const double height = heights.at(x, y);
      const double floor = is_interpolated ? highest_neighbour(heights, request.wrap, x, y) : height;
      double key = std::numeric_limits<double>::infinity();
      for (const double start_y : starts(y, heights.height, has_edge)) {
        for (const double start_x : starts(x, heights.width, has_edge)) {
          key = std::min(key, search.nearest({.x = start_x, .y = start_y, .height = height, .floor = floor}));
        }
      }
      radii[static_cast<std::size_t>(y) * static_cast<std::size_t>(heights.width) + static_cast<std::size_t>(x)] =
          ratio_of_key(key, search.metric());
    }
  });
  if (!is_interpolated) return radii;
  radii = min3x3(radii, heights.width, heights.height, request.wrap);
  const double diagonal = std::hypot(1.0 / heights.width, 1.0 / heights.height);
  for (float& radius : radii) radius = rounded_down(std::max(0.0, static_cast<double>(radius) - diagonal));
  return radii;
}

}  // namespace

std::vector<float> bake_safety_shape(const BakeRequest& request) {
  check_request(request, MapKind::safety_shape);
  const std::vector<float> ratios = bake_relaxed(request);
  const std::vector<float> radii = safe_radii(request);
  std::vector<float> shapes;
  shapes.reserve(2 * ratios.size());
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    shapes.push_back(ratios[i]);
    shapes.push_back(radii[i]);
  }
  return shapes;
}

}  // namespace reliefbench
