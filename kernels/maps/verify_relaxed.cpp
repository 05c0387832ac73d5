#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/judge/reference.h"
#include "kernels/maps/max_pyramid.h"
#include "kernels/maps/verify_cones.h"

namespace reliefbench {
namespace {

/// Texels inside one cone that descend away from its apex, by a descent through the max pyramid.
class LimitingTexels {
 public:
  explicit LimitingTexels(const RelaxedCones& request)
      : heights_(request.cones.heights()), wrap_(request.cones.wrap()), wedge_(request.wedge), pyramid_(heights_) {}

  /// returns: the greatest factor by which the cone is too wide; 1 if it is not
  [[nodiscard]] double worst_factor(int x, int y, float ratio) const {
    double factor = 1;
    // Beyond half a tile a texel's other images may be inside the cone too.
    const int reach = wrap_ == Wrap::repeat ? 1 : 0;
    for (int tile_y = -reach; tile_y <= reach; ++tile_y)
      for (int tile_x = -reach; tile_x <= reach; ++tile_x)
        descend({.x = x - tile_x * heights_.width,
                 .y = y - tile_y * heights_.height,
                 .low = heights_.at(x, y),
                 .ratio = ratio},
                factor);
    return factor;
  }

 private:
  /// An apex, in texels of the tile that is searched.
  struct Apex {
    int x, y;
    double low, ratio;
  };
  struct Node {
    std::size_t x, y, level;
  };

  void descend(const Apex& apex, double& factor) const {
    std::vector<Node> open{{.x = 0, .y = 0, .level = pyramid_.levels().size() - 1}};
    while (!open.empty()) {
      const Node node = open.back();
      open.pop_back();
      const double reach = apex.ratio * (pyramid_.levels()[node.level].at(node.x, node.y) - apex.low);
      const double distance = std::hypot(gap(apex.x, node.x, node.level) / heights_.width,
                                         gap(apex.y, node.y, node.level) / heights_.height);
      if (reach <= 0 || distance >= reach * kWitnessGuard) continue;
      if (node.level > 0) {
        for (const std::size_t child : {0U, 1U, 2U, 3U})
          open.push_back({.x = 2 * node.x + child % 2, .y = 2 * node.y + child / 2, .level = node.level - 1});
      } else if (is_limiting(static_cast<int>(node.x), static_cast<int>(node.y), apex)) {
        factor = std::max(factor, reach / distance);
      }
    }
  }

  /// Texels from `apex` to the nearest of 2^level texels, along one axis.
  static double gap(int apex, std::size_t node, std::size_t level) {
    const auto first = static_cast<int>(node << level);
    const int last = first + (1 << level) - 1;
    return std::max({0, first - apex, apex - last});
  }

  /// Whether the surface descends before or behind the texel, on the way away from the apex. On either side the
  /// derivative of the bilinear cell at its corner is that of the two edges there.
  [[nodiscard]] bool is_limiting(int x, int y, const Apex& apex) const {
    const int dx = x - apex.x;
    const int dy = y - apex.y;
    if (wedge_ &&
        !has_direction(*wedge_, static_cast<double>(dx) / heights_.width, static_cast<double>(dy) / heights_.height))
      return false;
    const int step_x = dx >= 0 ? 1 : -1;
    const int step_y = dy >= 0 ? 1 : -1;
    const double here = at(x, y);
    const double ahead = std::abs(dx) * (at(x + step_x, y) - here) + std::abs(dy) * (at(x, y + step_y) - here);
    const double before = std::abs(dx) * (here - at(x - step_x, y)) + std::abs(dy) * (here - at(x, y - step_y));
    return ahead < 0 || before < 0;
  }

  [[nodiscard]] double at(int x, int y) const {
    return heights_.at(wrapped(x, heights_.width, wrap_), wrapped(y, heights_.height, wrap_));
  }

  const Heightfield& heights_;
  Wrap wrap_;
  std::optional<Wedge> wedge_;
  MaxPyramid pyramid_;
};

/// Point i of a sequence that fills the five-dimensional unit cube evenly: multiples of powers of the root of
/// x^6 = x + 1, modulo 1 (Kronecker).
std::array<double, 5> even_point(int i) {
  constexpr double kRoot = 1.1347241384015194;
  std::array<double, 5> point{};
  double power = 1;
  for (double& coordinate : point) {
    power /= kRoot;
    const double multiple = 0.5 + i * power;
    coordinate = multiple - std::floor(multiple);
  }
  return point;
}

/// A ray from the top plate, and t at the point from which on it is seen inside the cone below that point.
struct ConeRay {
  TextureRay ray;
  double t = 0;
};

/// Through any point over the relief, in any direction, from half to 16 times as far per height as its cone is wide.
ConeRay cone_ray(const StoredCones& cones, int i) {
  const auto [u, v, turn, rise, tilt] = even_point(i);
  const auto [cell, fx, fy] = cones.at(u, v);
  const double slope = cones.ratio(cell, fx, fy) * std::exp2(5 * tilt - 1);
  const double slope_u = slope * std::cos(2 * std::numbers::pi * turn);
  const double slope_v = slope * std::sin(2 * std::numbers::pi * turn);
  const double t = (1 - StoredCones::height(cell, fx, fy)) * (1 - rise);
  return {.ray = {.u = static_cast<float>(u - slope_u * t),
                  .v = static_cast<float>(v - slope_v * t),
                  .slope_u = static_cast<float>(slope_u),
                  .slope_v = static_cast<float>(slope_v)},
          .t = t};
}

void trace(const RelaxedCones& shapes, const ReferenceTracer& tracer, const ConeRay& cone_ray, RayVerdict& verdict) {
  constexpr double kTouch = 1e-9;  // no thicker than rounding
  const auto& [ray, t] = cone_ray;
  if (shapes.wedge && !has_direction(*shapes.wedge, double{ray.slope_u}, double{ray.slope_v})) return;
  // The apex is where the ray's floats lead.
  const double u = ray.u + double{ray.slope_u} * t;
  const double v = ray.v + double{ray.slope_v} * t;
  const auto [cell, fx, fy] = shapes.cones.at(u, v);
  const double ratio = shapes.cones.ratio(cell, fx, fy);
  double radius = 0;
  if (shapes.radii != nullptr) {
    const StoredCones::Place place = shapes.radii->at(u, v);
    radius = shapes.radii->ratio(place.cell, place.fx, place.fy);
  }
  const ReferenceHit hit = tracer.trace(ray);
  if (hit.t_enter < t) return;
  verdict.rays += 1;
  const double rise = 1 - hit.t_exit - StoredCones::height(cell, fx, fy);
  const double distance = std::hypot(double{ray.slope_u}, double{ray.slope_v}) * (hit.t_exit - t);
  const double reach = std::max(ratio * rise, radius);
  if (hit.t_exit <= hit.t_enter + kTouch || !(distance < reach * kWitnessGuard)) return;
  verdict.crossing_twice += 1;
  keep_worse(verdict.worst, {.factor = reach / distance, .u = u - std::floor(u), .v = v - std::floor(v)});
}

}  // namespace

TexelVerdict verify_relaxed_texels(const RelaxedCones& request) {
  const StoredCones& cones = request.cones;
  const Heightfield& heights = cones.heights();
  const LimitingTexels limiting(request);
  std::vector<TexelVerdict> rows(static_cast<std::size_t>(heights.height));
  parallel_for(heights.height, request.threads, [&](int y) {
    const auto row = static_cast<std::size_t>(y);
    for (int x = 0; x < heights.width; ++x) {
      const std::size_t texel = row * static_cast<std::size_t>(heights.width) + static_cast<std::size_t>(x);
      const double factor = limiting.worst_factor(x, y, cones.at_texels()[texel]);
      if (factor > 1)
        rows[row].add({.too_wide = 1,
                       .worst = {.factor = factor, .u = (x + 0.5) / heights.width, .v = (y + 0.5) / heights.height}});
    }
  });
  TexelVerdict verdict;
  for (const TexelVerdict& row : rows) verdict.add(row);
  return verdict;
}

RayVerdict verify_rays(const RelaxedCones& request, int rays) {
  constexpr int kBatch = 4096;
  const StoredCones& cones = request.cones;
  const ReferenceTracer tracer(cones.heights(), cones.wrap());
  std::vector<RayVerdict> batches(static_cast<std::size_t>((rays + kBatch - 1) / kBatch));
  parallel_for(static_cast<int>(batches.size()), request.threads, [&](int batch) {
    for (int i = batch * kBatch; i < std::min((batch + 1) * kBatch, rays); ++i)
      trace(request, tracer, cone_ray(cones, i), batches[static_cast<std::size_t>(batch)]);
  });
  RayVerdict verdict;
  for (const RayVerdict& batch : batches) {
    verdict.rays += batch.rays;
    verdict.crossing_twice += batch.crossing_twice;
    keep_worse(verdict.worst, batch.worst);
  }
  return verdict;
}

}  // namespace reliefbench
