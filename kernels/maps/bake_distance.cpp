#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/rounding.h"
#include "kernels/image/image.h"
#include "kernels/maps/distance_map.h"

namespace reliefbench {
namespace {

constexpr double kSquareGuard = 1e-14;
constexpr double kShaderGuard = 1 - 0x1p-20;

void check_volume(const BakeRequest& request) {
  check_request(request, MapKind::distance);
  const int slices = request.value(kDistanceSlices);
  const auto& [width, height] = std::pair(request.heights.width, request.heights.height);
  if (VolumeAtlas(slices, width, height).columns == 0)
    fail_input("distance map: {} slices of {}x{} texels do not lie in one texture of at most {} a side", slices, width,
               height, kMaxSide);
}

/// The surface's maximum over the area of a texel: a bilinear patch is highest in a corner, and the four that meet in
/// the texel have theirs at its centre, its corners and the middles of its edges.
double highest_over(const Heightfield& heights, int x, int y, Wrap wrap) {
  const auto h = [&](int dx, int dy) -> double {
    return heights.at(wrapped(x + dx, heights.width, wrap), wrapped(y + dy, heights.height, wrap));
  };
  double highest = h(0, 0);
  for (const int dx : {-1, 1}) {
    highest = std::max({highest, (h(0, 0) + h(dx, 0)) / 2, (h(0, 0) + h(0, dx)) / 2});
    for (const int dy : {-1, 1}) highest = std::max(highest, (h(0, 0) + h(dx, 0) + h(0, dy) + h(dx, dy)) / 4);
  }
  return highest;
}

/// Squared distances along one axis: out[p] = min over q of f[q] + (gap(p - q) kTileSide / side)^2, where the gap
/// between two boxes is one less than that of their centres. Lower envelope of parabolas (Felzenszwalb, Huttenlocher
/// 2012) over f made wider by one box, which takes the gap's one off.
class AxisTransform {
 public:
  AxisTransform(int side, Wrap wrap) : side_(side), reach_(wrap == Wrap::repeat ? side / 2 : 0) {
    // Under repeat the nearest image is in reach; under clamp nothing beyond the edge is nearer than the edge.
    for (int i = -reach_ - 1; i <= side + reach_; ++i) source_.push_back(wrapped(i, side, wrap));
    line_.resize(source_.size());
    pieces_.reserve(source_.size());
  }

  /// f: `side` values, `stride` apart; overwritten with the result
  void run(double* f, std::ptrdiff_t stride) {
    for (std::size_t i = 0; i < line_.size(); ++i) line_[i] = f[source_[i] * stride];
    pieces_.clear();
    for (int q = 0; q < side_ + 2 * reach_; ++q) {
      const auto i = static_cast<std::size_t>(q);
      add({.centre = q, .base = std::min({line_[i], line_[i + 1], line_[i + 2]}), .begin = 0});
    }
    auto piece = pieces_.begin();
    for (int p = 0; p < side_; ++p) {
      const int place = p + reach_;
      while (piece + 1 != pieces_.end() && piece[1].begin < place) ++piece;
      f[p * stride] = piece->base + weight_ * (place - piece->centre) * (place - piece->centre);
    }
  }

 private:
  /// A parabola of the envelope.
  struct Piece {
    int centre;
    double base;
    double begin;  ///< from here on it is the lowest
  };

  void add(Piece next) {
    for (; !pieces_.empty(); pieces_.pop_back()) {
      const Piece& last = pieces_.back();
      const double rise = (next.base - last.base) / weight_;
      next.begin = 0.5 * (rise / (next.centre - last.centre) + next.centre + last.centre);
      if (next.begin > last.begin) break;
    }
    pieces_.push_back(next);
  }

  int side_;
  int reach_;
  double weight_ = kTileSide / side_ * kTileSide / side_;
  std::vector<int> source_;   ///< of each element of line_
  std::vector<double> line_;  ///< f with what lies in reach on either side, and one more
  std::vector<Piece> pieces_;
};

float guarded_distance(double squared) {
  return rounded_down(std::sqrt(std::max(squared - kSquareGuard, 0.0)) * kShaderGuard);
}

}  // namespace

VolumeAtlas::VolumeAtlas(int slices, int map_width, int map_height) {
  std::pair least(std::numeric_limits<int>::max(), 0);
  for (int across = 1; across <= std::min(slices, kMaxSide / map_width); ++across) {
    const int down = (slices + across - 1) / across;
    if (down > kMaxSide / map_height) continue;
    const std::pair size(across * down, std::max(across * map_width, down * map_height));
    if (size >= least) continue;
    least = size;
    columns = across;
    rows = down;
  }
}

std::vector<float> bake_distance(const BakeRequest& request) {
  check_volume(request);
  const int width = request.heights.width;
  const int height = request.heights.height;
  const int slices = request.value(kDistanceSlices);
  const auto columns = static_cast<std::size_t>(width);
  std::vector<double> highest(request.heights.texels.size());
  parallel_for(height, request.threads, [&](int y) {
    for (int x = 0; x < width; ++x)
      highest[static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x)] =
          highest_over(request.heights, x, y, request.wrap);
  });

  std::vector<float> values(highest.size() * static_cast<std::size_t>(slices));
  parallel_for(slices, request.threads, [&](int slice) {
    const double bottom = static_cast<double>(slice) / slices;
    std::vector<double> squared(highest.size());
    for (std::size_t i = 0; i < squared.size(); ++i) {
      const double gap = std::max(bottom - highest[i], 0.0);
      squared[i] = gap * gap;
    }
    AxisTransform along_x(width, request.wrap);
    for (std::size_t row = 0; row < squared.size(); row += columns) along_x.run(&squared[row], 1);
    AxisTransform along_y(height, request.wrap);
    for (std::size_t x = 0; x < columns; ++x) along_y.run(&squared[x], width);
    std::transform(squared.begin(), squared.end(), &values[static_cast<std::size_t>(slice) * squared.size()],
                   guarded_distance);
  });
  return values;
}

}  // namespace reliefbench
