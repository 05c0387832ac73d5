#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/parallel.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/max_pyramid.h"

namespace reliefbench {
namespace {

constexpr float kUnreached = std::numeric_limits<float>::infinity();
constexpr float kMargin = 1 + 4e-6F;  // over the rounding of a bound in float

/// Which point of a neighbour node stands for its highest texel.
enum class Footpoint {
  nearest,    ///< its nearest texel
  unvisited,  ///< its nearest texel that no finer level has visited
  centre,     ///< its centre
};

/// A node's distances from a texel along one axis, in texels.
struct Side {
  float near = kUnreached;  ///< to the node; +inf: there is no such neighbour
  float far = kUnreached;   ///< to the part of it that finer levels have not visited; +inf: they have visited it all
  int node = 0;
};

/// Along one axis, at one level: the node of a texel, and its two neighbours.
struct Stop {
  int node;
  Side low, high;
};

/// How far something reaches below and above a texel along an axis, in texels.
struct Extent {
  int low = 0;
  int high = 0;
};

class MapAxis {
 public:
  MapAxis(int side, Wrap wrap, Footpoint footpoint)
      : side_(side), repeats_(wrap == Wrap::repeat), footpoint_(footpoint) {}

  [[nodiscard]] Stop stop(int texel, int level) const {
    const int nodes = nodes_at(level);
    const int node = texel >> level;
    // Two nodes on a ring are neighbours once; one has none.
    const bool has_low = repeats_ ? nodes > 1 : node > 0;
    const bool has_high = repeats_ ? nodes > 2 : node + 1 < nodes;
    const Extent visited = level > 0 ? block(texel, level - 1) : Extent{};
    Stop stop{.node = node, .low = {.node = node}, .high = {.node = node}};
    if (has_low) stop.low = neighbour(texel, (node + nodes - 1) % nodes, level, visited);
    if (has_high) stop.high = neighbour(texel, (node + 1) % nodes, level, visited);
    return stop;
  }

 private:
  [[nodiscard]] int nodes_at(int level) const { return ((side_ - 1) >> level) + 1; }

  /// What a texel's node and its two neighbours cover. The last node of a level may hold fewer texels than the others.
  [[nodiscard]] Extent block(int texel, int level) const {
    const int size = 1 << level;
    const int node = texel >> level;
    const int last = nodes_at(level) - 1;
    Extent extent{.low = texel - std::max(0, (node - 1) * size),
                  .high = std::min(side_, (node + 2) * size) - 1 - texel};
    if (!repeats_ || last == 0) return extent;
    if (node == 0) extent.low += side_ - last * size;
    if (node == last) extent.high += size;
    return extent;
  }

  [[nodiscard]] Side neighbour(int texel, int node, int level, Extent visited) const {
    // A clamped axis is part of a ring so long that nothing is near round its other side.
    const int ring = repeats_ ? side_ : 4 * side_;
    const int first = node << level;
    const int last = std::min(side_, first + (1 << level)) - 1;
    const auto around = [&](auto down) { return static_cast<float>(std::min(down, ring - down)); };
    if (footpoint_ == Footpoint::centre) {
      const float centre = around(std::abs(0.5 * (first + last) - texel));
      return {.near = centre, .far = centre, .node = node};
    }
    // The ways down from the texel to the node's texels; the ways up are what is left of the ring.
    const int from = (texel - last + ring) % ring;
    const int to = (texel - first + ring) % ring;
    const float near = std::min(around(from), around(to));
    if (footpoint_ == Footpoint::nearest) return {.near = near, .far = near, .node = node};
    const int new_from = std::max(from, visited.low + 1);
    const int new_to = std::min(to, ring - visited.high - 1);
    const bool is_visited = new_from > new_to;
    if (is_visited) return {.near = near, .far = kUnreached, .node = node};
    return {.near = near, .far = std::min(around(new_from), around(new_to)), .node = node};
  }

  int side_;
  bool repeats_;
  Footpoint footpoint_;
};

/// The stops of all texels along an axis, the levels of a texel together.
std::vector<Stop> stops(const MapAxis& axis, int side, int levels) {
  std::vector<Stop> all;
  all.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(levels));
  for (int texel = 0; texel < side; ++texel) {
    for (int level = 0; level < levels; ++level) all.push_back(axis.stop(texel, level));
  }
  return all;
}

/// A Side's distances, squared, in a unit of length that has both axes.
template <class Number>
struct Squares {
  Number near, far;
  Squares(const Side& side, Number weight)
      : near(static_cast<Number>(side.near) * static_cast<Number>(side.near) * weight),
        far(static_cast<Number>(side.far) * static_cast<Number>(side.far) * weight) {}
};

enum class Corner { low_low, high_low, low_high, high_high };

/// A corner neighbour is an L where the finer levels have visited a quarter of it: the nearer of its two arms.
struct NearerArm {
  template <Corner, class Number>
  static Number distance2(const Squares<Number>& column, const Squares<Number>& row) {
    return std::min(column.near + row.far, column.far + row.near);
  }
};

/// The corners as the published shader measures them [VB22, QuickConemap.cs.slang]. In the corner below both
/// coordinates its comparison of the two arms is reversed, so that it takes the farther one. In the corner low in x and
/// high in y it looks for an index with remainder -1 modulo 2, which none has, and so takes the part beyond the visited
/// columns even in the rows where nothing of the node has been visited.
struct PublishedArm {
  template <Corner kCorner, class Number>
  static Number distance2(const Squares<Number>& column, const Squares<Number>& row) {
    const Number beyond_columns = column.far + row.near;
    const Number beyond_rows = column.near + row.far;
    auto published = static_cast<Number>(kUnreached);
    if constexpr (kCorner == Corner::low_low) published = std::max(beyond_columns, beyond_rows);
    if constexpr (kCorner == Corner::low_high) published = beyond_columns;
    // Its maps have powers of two for sides, where both parts exist.
    return published < static_cast<Number>(kUnreached) ? published : std::min(beyond_columns, beyond_rows);
  }
};

/// A texel's cone as it narrows.
class Narrowing {
 public:
  Narrowing(const ConeMetric& metric, float max_ratio, float height)
      : metric_(metric), slack_(static_cast<float>(metric.slack / metric.weight_y)), height_(height) {
    const double widest = metric.side * static_cast<double>(max_ratio);
    set_key(widest * widest);
  }

  /// A node as high as `top`. distance2: in units of weight_y, rounded; exact(): in the metric's unit, asked for only
  /// where it may matter.
  template <class Exact>
  void lower(float distance2, float top, const Exact& exact) {
    const float rise = top - height_;
    if (rise <= 0 || distance2 >= limit_ * rise * rise + slack_) return;
    const double exact_rise = static_cast<double>(top) - static_cast<double>(height_);
    const double key = (exact() - metric_.slack) / (exact_rise * exact_rise);
    if (key < key_) set_key(key);
  }

  [[nodiscard]] float ratio() const { return ratio_of_key(key_, metric_); }

 private:
  void set_key(double key) {
    key_ = key;
    limit_ = static_cast<float>(key / metric_.weight_y) * kMargin;
  }

  const ConeMetric& metric_;
  float slack_;
  float height_;
  double key_ = 0;
  float limit_ = 0;  // key in units of weight_y, rounded up
};

/// The nodes of one level round the node of a texel.
template <class Arm>
void visit(const MaxPyramid::Level& level, const Stop& column, const Stop& row, const ConeMetric& metric, float aspect,
           Narrowing& cone) {
  const auto row_of = [&](int j) { return level.nodes.data() + static_cast<std::size_t>(j) * level.stride; };
  const Squares<float> left(column.low, aspect);
  const Squares<float> right(column.high, aspect);
  const Squares<float> above(row.low, 1);
  const Squares<float> below(row.high, 1);
  const auto exact_x = [&](const Side& side) { return Squares<double>(side, metric.weight_x); };
  const auto exact_y = [&](const Side& side) { return Squares<double>(side, metric.weight_y); };
  const auto corner = [&]<Corner kCorner>(const Squares<float>& x, const Squares<float>& y, const Side& side_x,
                                          const Side& side_y, float top) {
    cone.lower(Arm::template distance2<kCorner>(x, y), top,
               [&] { return Arm::template distance2<kCorner>(exact_x(side_x), exact_y(side_y)); });
  };
  const float* const middle = row_of(row.node);
  cone.lower(left.far, middle[column.low.node], [&] { return exact_x(column.low).far; });
  cone.lower(right.far, middle[column.high.node], [&] { return exact_x(column.high).far; });
  const float* const low = row_of(row.low.node);
  cone.lower(above.far, low[column.node], [&] { return exact_y(row.low).far; });
  corner.template operator()<Corner::low_low>(left, above, column.low, row.low, low[column.low.node]);
  corner.template operator()<Corner::high_low>(right, above, column.high, row.low, low[column.high.node]);
  const float* const high = row_of(row.high.node);
  cone.lower(below.far, high[column.node], [&] { return exact_y(row.high).far; });
  corner.template operator()<Corner::low_high>(left, below, column.low, row.high, high[column.low.node]);
  corner.template operator()<Corner::high_high>(right, below, column.high, row.high, high[column.high.node]);
}

template <class Arm>
std::vector<float> region_growing(const BakeRequest& request, Footpoint footpoint) {
  const Heightfield& heights = request.heights;
  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  const auto aspect = static_cast<float>(metric.weight_x / metric.weight_y);
  const MaxPyramid pyramid(heights);
  const auto levels = pyramid.levels().size() - 1;  // the root has no neighbours
  const auto stops_of = [&](int side) {
    return stops(MapAxis(side, request.wrap, footpoint), side, static_cast<int>(levels));
  };
  const std::vector<Stop> columns = stops_of(heights.width);
  const std::vector<Stop> rows = stops_of(heights.height);

  std::vector<float> ratios(heights.texels.size());
  const auto width = static_cast<std::size_t>(heights.width);
  parallel_for(heights.height, request.threads, [&](int y) {
    const Stop* const row = &rows[static_cast<std::size_t>(y) * levels];
    for (std::size_t x = 0; x < width; ++x) {
      const Stop* const column = &columns[x * levels];
      Narrowing cone(metric, request.max_ratio, heights.at(static_cast<int>(x), y));
      for (std::size_t k = 0; k < levels; ++k) {
        visit<Arm>(pyramid.levels()[k], column[k], row[k], metric, aspect, cone);
      }
      ratios[static_cast<std::size_t>(y) * width + x] = cone.ratio();
    }
  });
  if (request.correction == Correction::none || request.correction == Correction::min4) return ratios;
  return min3x3(ratios, heights.width, heights.height, request.wrap);
}

}  // namespace

std::vector<float> bake_quick_naive(const BakeRequest& request) {
  check_request(request, MapKind::quick_naive);
  return region_growing<NearerArm>(request, Footpoint::nearest);
}

std::vector<float> bake_quick(const BakeRequest& request) {
  check_request(request, MapKind::quick);
  return region_growing<NearerArm>(request, Footpoint::unvisited);
}

std::vector<float> bake_quick_published(const BakeRequest& request) {
  check_request(request, MapKind::quick_published);
  return region_growing<PublishedArm>(request, Footpoint::unvisited);
}

std::vector<float> bake_quick_centre(const BakeRequest& request) {
  check_request(request, MapKind::quick_centre);
  return region_growing<NearerArm>(request, Footpoint::centre);
}

}  // namespace reliefbench
