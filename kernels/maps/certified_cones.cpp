#include "kernels/maps/certified_cones.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/maps/cone_bounds.h"
#include "kernels/maps/cone_map.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

constexpr int kPerTexel = 4;

/// Raises texels' ratios as far as a bound at every point of a finer grid allows.
class Raising {
 public:
  Raising(const BakeRequest& request, Subdivision by, const FineRatios& limits)
      : request_(request),
        by_(by),
        limits_(limits),
        weights_x_(point_weights(by.x)),
        weights_y_(point_weights(by.y)),
        ratios_(request.heights.texels.size()) {
    // The least limit of its points is safe for every texel together. Then one turn each is enough: whatever is raised
    // after a texel only leaves that texel less room.
    for_each_texel([&](int x, int y, float& ratio) {
      ratio = std::numeric_limits<float>::max();
      for_each_point(x, y, [&](float limit, int, int) { ratio = std::min(ratio, limit); });
    });
    const RaisingTurns turns(request);
    for (int turn = 0; turn < turns.count(); ++turn)
      for_each_texel([&](int x, int y, float& ratio) {
        if (turns.of(x, y) == turn) ratio += rise(x, y);
      });
  }

  [[nodiscard]] std::vector<float> take() { return std::move(ratios_); }

 private:
  template <typename Body>
  void for_each_texel(const Body& body) {
    parallel_for(request_.heights.height, request_.threads, [&](int y) {
      for (int x = 0; x < request_.heights.width; ++x) body(x, y, ratios_[request_.heights.index(x, y)]);
    });
  }

  /// Those that a texel has weight at: body(limit, points from the texel along x, along y).
  template <typename Body>
  void for_each_point(int x, int y, const Body& body) const {
    for (int j = 1 - by_.y; j < by_.y; ++j)
      for (int i = 1 - by_.x; i < by_.x; ++i) {
        const int column = x * by_.x + i;
        const int row = y * by_.y + j;
        const bool is_outside = column < 0 || column >= limits_.width || row < 0 || row >= limits_.height;
        if (is_outside && request_.wrap == Wrap::clamp) continue;
        body(limits_.at(wrapped(column, limits_.width, request_.wrap), wrapped(row, limits_.height, request_.wrap)), i,
             j);
      }
  }

  [[nodiscard]] float ratio_at(int x, int y) const {
    const auto [width, height] = std::pair(request_.heights.width, request_.heights.height);
    return ratios_[request_.heights.index(wrapped(x, width, request_.wrap), wrapped(y, height, request_.wrap))];
  }

  [[nodiscard]] float rise(int x, int y) const {
    float least = std::numeric_limits<float>::max();
    for_each_point(x, y, [&](float limit, int i, int j) {
      const PointWeight here_x = weights_x_[static_cast<std::size_t>(std::abs(i))];
      const PointWeight here_y = weights_y_[static_cast<std::size_t>(std::abs(j))];
      const float there_x = weights_x_[static_cast<std::size_t>(by_.x - std::abs(i))].share;
      const float there_y = weights_y_[static_cast<std::size_t>(by_.y - std::abs(j))].share;
      const int across = i < 0 ? x - 1 : x + 1;
      const int along = j < 0 ? y - 1 : y + 1;
      const float interpolated = (ratio_at(x, y) * here_x.share + ratio_at(across, y) * there_x) * here_y.share +
                                 (ratio_at(x, along) * here_x.share + ratio_at(across, along) * there_x) * there_y;
      least = std::min(least, (limit - interpolated) * (here_x.stretch * here_y.stretch));
    });
    return std::max(least, 0.0F);
  }

  const BakeRequest& request_;
  Subdivision by_;
  const FineRatios& limits_;
  std::vector<PointWeight> weights_x_;
  std::vector<PointWeight> weights_y_;
  std::vector<float> ratios_;
};

/// The least bound of the cells round each point, guarded.
FineRatios limits_at_points(const FineRatios& cells, Wrap wrap) {
  const int border = wrap == Wrap::clamp ? 1 : 0;
  FineRatios points{.width = cells.width + border, .height = cells.height + border, .ratios = {}};
  points.ratios.reserve(static_cast<std::size_t>(points.width) * static_cast<std::size_t>(points.height));
  for (int j = 0; j < points.height; ++j) {
    const int below = wrapped(j - 1, cells.height, wrap);
    const int row = wrapped(j, cells.height, wrap);
    for (int i = 0; i < points.width; ++i) {
      const int left = wrapped(i - 1, cells.width, wrap);
      const int column = wrapped(i, cells.width, wrap);
      points.ratios.push_back(kRaisingGuard * std::min({cells.at(left, below), cells.at(column, below),
                                                        cells.at(left, row), cells.at(column, row)}));
    }
  }
  return points;
}

/// 3 where an odd number of texels repeats.
int turns_along(int side, Wrap wrap) { return wrap == Wrap::repeat && side % 2 == 1 ? 3 : 2; }

}  // namespace

Subdivision certified_points(const Heightfield& heights) {
  int k = kPerTexel;
  while (!is_affordable(heights.width, heights.height, subdivision(heights.width, heights.height, k))) k /= 2;
  return subdivision(heights.width, heights.height, k);
}

std::vector<PointWeight> point_weights(int by) {
  std::vector<PointWeight> weights(static_cast<std::size_t>(by) + 1);
  for (int offset = 0; offset < by; ++offset)
    weights[static_cast<std::size_t>(offset)] = {.share = static_cast<float>(by - offset) / static_cast<float>(by),
                                                 .stretch = static_cast<float>(by) / static_cast<float>(by - offset)};
  return weights;
}

RaisingTurns::RaisingTurns(const BakeRequest& request)
    : along_{turns_along(request.heights.width, request.wrap), turns_along(request.heights.height, request.wrap)},
      last_{request.heights.width - 1, request.heights.height - 1} {}

std::vector<float> certified_cones(const BakeRequest& request) { return certified_cones(request, std::nullopt); }

std::vector<float> certified_cones(const BakeRequest& request, const std::optional<Wedge>& wedge) {
  const Subdivision by = certified_points(request.heights);
  BoundRequest bounds{.heights = request.heights,
                      .wrap = request.wrap,
                      .max_ratio = request.max_ratio,
                      .wedge = wedge,
                      .threads = request.threads};
  const FineRatios of_cells = lower_cone_bounds(bounds);
  bounds.by = by;
  FineRatios of_fine_cells = lower_cone_bounds(bounds);
  keep_coarser(of_fine_cells, of_cells);
  return Raising(request, by, limits_at_points(of_fine_cells, request.wrap)).take();
}

}  // namespace reliefbench
