#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/cone_map.h"
#include "kernels/cone_search.h"
#include "kernels/max_pyramid.h"
#include "kernels/parallel.h"

namespace reliefbench {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// Which point of a neighbour node stands for its highest texel.
enum class Footpoint {
  nearest,    ///< its nearest texel
  unvisited,  ///< its nearest texel that no finer level has visited
  centre,     ///< its centre
};

/// A node's distances from a texel along one axis, squared, in the unit of ConeMetric.
struct Side {
  double near2 = kNone;  ///< to the node; +inf: there is no such neighbour
  double far2 = kNone;   ///< to the part of it that finer levels have not visited; +inf: they have visited it all
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

class Axis {
 public:
  Axis(int side, Wrap wrap, double weight, Footpoint footpoint)
      : side_(side), repeats_(wrap == Wrap::repeat), weight_(weight), footpoint_(footpoint) {}

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
    if (footpoint_ == Footpoint::centre) {
      const double offset = std::abs(0.5 * (first + last) - texel);
      const double near2 = squared(std::min(offset, ring - offset));
      return {.near2 = near2, .far2 = near2, .node = node};
    }
    // The ways down from the texel to the node's texels; the ways up are what is left of the ring.
    const int from = (texel - last + ring) % ring;
    const int to = (texel - first + ring) % ring;
    Side side{.near2 = squared(std::min(from, ring - to)), .node = node};
    const int new_from = std::max(from, visited.low + 1);
    const int new_to = std::min(to, ring - visited.high - 1);
    if (footpoint_ == Footpoint::nearest) {
      side.far2 = side.near2;
    } else if (new_from <= new_to) {
      side.far2 = squared(std::min(new_from, ring - new_to));
    }
    return side;
  }

  [[nodiscard]] double squared(double texels) const { return texels * texels * weight_; }

  int side_;
  bool repeats_;
  double weight_;
  Footpoint footpoint_;
};

/// The stops of all texels along an axis, the levels of a texel together.
std::vector<Stop> stops(const Axis& axis, int side, int levels) {
  std::vector<Stop> all;
  all.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(levels));
  for (int texel = 0; texel < side; ++texel) {
    for (int level = 0; level < levels; ++level) all.push_back(axis.stop(texel, level));
  }
  return all;
}

enum class Corner { low_low, high_low, low_high, high_high };

/// A corner neighbour is an L where the finer levels have visited a quarter of it: the nearer of its two arms.
struct NearerArm {
  template <Corner>
  static double distance2(const Side& column, const Side& row) {
    return std::min(column.near2 + row.far2, column.far2 + row.near2);
  }
};

/// The corners as the published shader measures them [VB22, QuickConemap.cs.slang]. In the corner below both
/// coordinates its comparison of the two arms is reversed, so that it takes the farther one. In the corner low in x and
/// high in y it looks for an index with remainder -1 modulo 2, which none has, and so takes the part beyond the visited
/// columns even in the rows where nothing of the node has been visited.
struct PublishedArm {
  template <Corner kCorner>
  static double distance2(const Side& column, const Side& row) {
    if constexpr (kCorner == Corner::low_low) {
      const double farther = std::max(column.near2 + row.far2, column.far2 + row.near2);
      if (farther < kNone) return farther;
    }
    if (kCorner == Corner::low_high && column.far2 + row.near2 < kNone) return column.far2 + row.near2;
    return NearerArm::distance2<kCorner>(column, row);
  }
};

template <class Arm>
std::vector<float> region_growing(const BakeRequest& request, Footpoint footpoint) {
  const Heightfield& heights = request.heights;
  const ConeMetric metric = cone_metric(heights.width, heights.height, request.correction);
  const MaxPyramid pyramid(heights);
  const auto levels = pyramid.levels().size() - 1;  // the root has no neighbours
  const auto stops_of = [&](int side, double weight) {
    return stops(Axis(side, request.wrap, weight, footpoint), side, static_cast<int>(levels));
  };
  const std::vector<Stop> all_columns = stops_of(heights.width, metric.weight_x);
  const std::vector<Stop> all_rows = stops_of(heights.height, metric.weight_y);
  const double widest = metric.side * static_cast<double>(request.max_ratio);
  constexpr double kMargin = 1 + 1e-15;  // over the rounding of a product that stands for a quotient

  std::vector<float> ratios(heights.texels.size());
  const auto width = static_cast<std::size_t>(heights.width);
  parallel_for(heights.height, request.threads, [&](int y) {
    const Stop* const rows = &all_rows[static_cast<std::size_t>(y) * levels];
    for (std::size_t x = 0; x < width; ++x) {
      const Stop* const columns = &all_columns[x * levels];
      const double height = heights.at(static_cast<int>(x), y);
      double key = widest * widest;
      double limit = key * kMargin;
      const auto lower = [&](double distance2, float top) {
        const double rise = static_cast<double>(top) - height;
        // The division only where it may lower the key.
        if (rise <= 0 || distance2 - metric.slack >= limit * (rise * rise)) return;
        key = std::min(key, (distance2 - metric.slack) / (rise * rise));
        limit = key * kMargin;
      };
      for (std::size_t k = 0; k < levels; ++k) {
        const auto& [column, left, right] = columns[k];
        const auto& [row, above, below] = rows[k];
        const MaxPyramid::Level& level = pyramid.levels()[k];
        const auto row_of = [&](int j) { return level.nodes.data() + static_cast<std::size_t>(j) * level.stride; };
        const float* const middle = row_of(row);
        const float* const low = row_of(above.node);
        const float* const high = row_of(below.node);
        lower(left.far2, middle[left.node]);
        lower(right.far2, middle[right.node]);
        lower(above.far2, low[column]);
        lower(Arm::template distance2<Corner::low_low>(left, above), low[left.node]);
        lower(Arm::template distance2<Corner::high_low>(right, above), low[right.node]);
        lower(below.far2, high[column]);
        lower(Arm::template distance2<Corner::low_high>(left, below), high[left.node]);
        lower(Arm::template distance2<Corner::high_high>(right, below), high[right.node]);
      }
      ratios[static_cast<std::size_t>(y) * width + x] = ratio_of_key(key, metric);
    }
  });
  if (request.correction == Correction::none) return ratios;
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
