#include "kernels/trace/surface_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "kernels/trace/each_pixel.h"
#include "kernels/trace/mesh_frame.h"

namespace reliefbench {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kOver = 1e-9;  ///< of height: so far over the top plate a ray does not begin, whatever rounding does

/// Smallest and largest.
struct SpeedRange {
  double low;
  double high;
  void add(double speed) {
    low = std::min(low, speed);
    high = std::max(high, speed);
  }
};
SpeedRange product(const SpeedRange& a, const SpeedRange& b) {
  const std::array corners{a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
  const auto [low, high] = std::ranges::minmax(corners);
  return {low, high};
}
SpeedRange speed_of(const Moving& m) { return {m.speed - m.sway, m.speed + m.sway}; }

/// A pixel's ray through the displaced surface: F(way) is its height over the surface there.
class SurfaceWalk {
 public:
  SurfaceWalk(const ReferenceTracer& tracer, const SurfaceShape& shape, const SurfaceRay& ray, Wrap wrap)
      : tracer_(tracer),
        shape_(shape),
        ray_(ray),
        wrap_(wrap),
        side_u_(shape.tiling * tracer.width()),
        side_v_(shape.tiling * tracer.height()) {}

  /// The first crossing behind `from`, into the solid or out of it; kNowhere where the ray leaves the top plate before.
  template <bool kOutwards>
  [[nodiscard]] double crossing(double from);

 private:
  struct Stretch {
    double begin;
    double end;
  };
  enum class Found { nothing, crossing, undecided, left };

  template <bool kOutwards>
  [[nodiscard]] Found look(const Stretch& stretch);
  [[nodiscard]] double gap(double way) const;
  [[nodiscard]] double refined(Stretch bracket) const;
  [[nodiscard]] Point3 point(double way) const {
    Point3 p = ray_.from;
    for (std::size_t i = 0; i < 3; ++i) p.at(i) += ray_.direction.at(i) * way;
    return p;
  }

  const ReferenceTracer& tracer_;
  const SurfaceShape& shape_;
  const SurfaceRay& ray_;
  Wrap wrap_;
  double side_u_;  ///< texels in a side of the unit square
  double side_v_;
  double found_ = 0;
};

/// Where in the grid of cells a stretch may be; far numbers stay small enough to be whole ones.
std::int64_t cell_at(double texel) { return static_cast<std::int64_t>(std::floor(std::clamp(texel, -1e12, 1e12))); }

double SurfaceWalk::gap(double way) const {
  const Located at = shape_.locate(point(way), ray_.direction, 0);
  const double x = at.u.value * side_u_ - 0.5;
  const double y = at.v.value * side_v_ - 0.5;
  const double fx = x - std::floor(x);
  const double fy = y - std::floor(y);
  const auto h = tracer_.corners(cell_at(x), cell_at(y));
  return at.height.value - ((h.h00 * (1 - fx) + h.h10 * fx) * (1 - fy) + (h.h01 * (1 - fx) + h.h11 * fx) * fy);
}

/// The one crossing in a bracket, by regula falsi that halves where it is slow (Illinois).
double SurfaceWalk::refined(Stretch bracket) const {
  double begin_gap = gap(bracket.begin);
  double end_gap = gap(bracket.end);
  int same = 0;
  constexpr int kMostSteps = 200;
  for (int i = 0; i < kMostSteps && bracket.end - bracket.begin > 0.01 * kTouchWay; ++i) {
    double middle = bracket.begin + (bracket.end - bracket.begin) * (begin_gap / (begin_gap - end_gap));
    if (!(middle > bracket.begin && middle < bracket.end)) middle = 0.5 * (bracket.begin + bracket.end);
    if (!(middle > bracket.begin && middle < bracket.end)) break;
    const double middle_gap = gap(middle);
    if ((middle_gap > 0) == (begin_gap > 0)) {
      bracket.begin = middle;
      begin_gap = middle_gap;
      if (same == 1) end_gap *= 0.5;
      same = 1;
    } else {
      bracket.end = middle;
      end_gap = middle_gap;
      if (same == -1) begin_gap *= 0.5;
      same = -1;
    }
    if (middle_gap == 0) return middle;
  }
  return bracket.end;
}

template <bool kOutwards>
SurfaceWalk::Found SurfaceWalk::look(const Stretch& stretch) {
  const double half = 0.5 * (stretch.end - stretch.begin);
  const double middle = stretch.begin + half;
  const Located at = shape_.locate(point(middle), ray_.direction, half);
  const double low = at.height.value - at.height.reach;
  const double high = at.height.value + at.height.reach;
  if (low > 1 + kOver) return Found::left;
  const auto cells = [](const Moving& m, double side) {
    return std::array{cell_at((m.value - m.reach) * side - 0.5), cell_at((m.value + m.reach) * side - 0.5)};
  };
  if (wrap_ == Wrap::clamp) {  // beyond the unit square there is no surface, and nothing leads back
    const auto is_off = [](const Moving& m) { return m.value + m.reach < 0 || m.value - m.reach > 1; };
    if (is_off(at.u) || is_off(at.v)) return Found::left;
  }
  const auto x = cells(at.u, side_u_);
  const auto y = cells(at.v, side_v_);
  const auto range = tracer_.height_range(x[0], y[0], x[1], y[1]);
  if (kOutwards ? high <= range.min : low > range.max) return Found::nothing;
  if (x[1] - x[0] <= 1 && y[1] - y[0] <= 1) {  // across borders the surface goes on without a step
    SpeedRange along_u{kNowhere, -kNowhere};
    SpeedRange along_v = along_u;
    for (std::int64_t j = y[0]; j <= y[1]; ++j)
      for (std::int64_t i = x[0]; i <= x[1]; ++i) {
        const auto h = tracer_.corners(i, j);
        along_u.add(side_u_ * (h.h10 - h.h00));
        along_u.add(side_u_ * (h.h11 - h.h01));
        along_v.add(side_v_ * (h.h01 - h.h00));
        along_v.add(side_v_ * (h.h11 - h.h10));
      }
    const SpeedRange by_u = product(along_u, speed_of(at.u));
    const SpeedRange by_v = product(along_v, speed_of(at.v));
    const SpeedRange fall = speed_of(at.height);
    const SpeedRange change{fall.low - by_u.high - by_v.high, fall.high - by_u.low - by_v.low};
    const double steepest = std::max(std::abs(change.low), std::abs(change.high));
    const double here = gap(middle);
    if (kOutwards ? here + steepest * half < 0 : here - steepest * half > 0) return Found::nothing;
    if (change.low > 0 || change.high < 0) {  // one crossing at most
      const bool begins_under = gap(stretch.begin) <= 0;
      const bool ends_under = gap(stretch.end) <= 0;
      if (begins_under != kOutwards) {
        found_ = stretch.begin;
        return kOutwards && ends_under ? Found::nothing : Found::crossing;
      }
      if (ends_under == kOutwards) return Found::nothing;
      found_ = refined(stretch);
      return Found::crossing;
    }
  }
  if (half > kTouchWay) return Found::undecided;
  if (kOutwards && gap(stretch.end) <= 0) return Found::nothing;
  found_ = middle;
  return Found::crossing;
}

template <bool kOutwards>
double SurfaceWalk::crossing(double from) {
  // Stretches ahead, the nearest last. The whole way through the surface is no longer than its own size.
  const double size = 2 * (shape_.ring + shape_.tube);
  std::vector<Stretch> ahead;
  constexpr int kFirst = 64;
  ahead.reserve(kFirst);
  const double step = std::min(0.25 * shape_.relief, size);
  // A cylinder's rays may lie along it, and be as long as they like.
  const double end = from + std::min(1e4 * step, 64 * size);
  double length = step;
  for (double begin = from; begin < end;) {
    bool is_whole = true;
    ahead.push_back({.begin = begin, .end = begin + length});
    while (!ahead.empty()) {
      const Stretch stretch = ahead.back();
      ahead.pop_back();
      switch (look<kOutwards>(stretch)) {
        case Found::nothing:
          break;
        case Found::crossing:
          return found_;
        case Found::left:
          return kNowhere;
        case Found::undecided: {
          is_whole = false;
          const double middle = 0.5 * (stretch.begin + stretch.end);
          ahead.push_back({.begin = middle, .end = stretch.end});
          ahead.push_back({.begin = stretch.begin, .end = middle});
        }
      }
    }
    begin += length;
    length = is_whole ? 2 * length : step;  // deep under the surface of a large sphere nothing is near
  }
  return kNowhere;
}

std::array<double, 2> exact_place(const SurfaceShape& shape, const SurfaceRay& ray, double t) {
  const Located at = shape.locate(ray.at(t), ray.direction, 0);
  return {at.u.value * shape.tiling, at.v.value * shape.tiling};
}

/// What is left of a length less whole periods; 0: there are none.
double less_whole(double length, double period) {
  return period > 0 ? length - period * std::round(length / period) : length;
}

/// Tiles round the surface along u and v; 0: it does not close there.
std::array<double, 2> turns_of(const SurfaceShape& shape) {
  const double turn = 2 * std::numbers::pi * shape.tiling;
  return {turn * (shape.ring + shape.tube), shape.kind == SurfaceKind::torus ? turn * shape.tube : 0};
}

PixelScore score_on_mesh(const ScorePixel& pixel, const ReferenceHit& exact, const FrameUniforms& frame) {
  if (pixel.status == static_cast<float>(PixelStatus::no_ray) || is_unknown(exact)) return {};
  if (const auto passed = score_passed(pixel, exact)) return *passed;
  const double texels = std::hypot(static_cast<double>(pixel.ray.slope_u) * frame.sizes[2],
                                   static_cast<double>(pixel.ray.slope_v) * frame.sizes[3]);
  return score_pixel(pixel, exact, std::abs(static_cast<double>(pixel.t) - exact.t_enter) * texels);
}

/// Both ways over the map are counted from where the ray enters, since a ray's uv have lost whole tiles: what they are
/// apart is the whole error, but for turns round the surface.
PixelScore score_on_surface(const SurfaceShape& shape, const SurfaceRay& ray, const ScorePixel& pixel,
                            const ReferenceHit& exact, const FrameUniforms& frame, Wrap wrap) {
  if (const auto passed = score_passed(pixel, exact)) return *passed;
  const auto t = static_cast<double>(pixel.t);
  const std::array<double, 2> place = exact_place(shape, ray, exact.t_enter);
  const std::array<double, 2> turns = turns_of(shape);
  const std::array<float, 2> uv{pixel.ray.u, pixel.ray.v};
  const std::array<float, 2> slope{pixel.ray.slope_u, pixel.ray.slope_v};
  std::array<double, 2> apart{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double entry = ray.uv[axis] * shape.tiling;
    const double rounded = less_whole(static_cast<double>(uv.at(axis)) - entry, wrap == Wrap::repeat ? 1 : 0);
    const double way = static_cast<double>(slope.at(axis)) * t - (place.at(axis) - entry);
    apart.at(axis) = less_whole(rounded + way, turns.at(axis)) * frame.sizes[2 + axis];
  }
  return score_pixel(pixel, exact, std::hypot(apart[0], apart[1]));
}

}  // namespace

ReferenceHit trace_surface(const ReferenceTracer& tracer, const SurfaceShape& shape, const SurfaceRay& ray, Wrap wrap) {
  ReferenceHit hit{.t_enter = kNowhere, .t_exit = kNowhere};
  if (!ray.enters) return hit;
  SurfaceWalk walk(tracer, shape, ray, wrap);
  const double enter = walk.crossing<false>(ray.way);
  if (enter == kNowhere) return hit;
  hit.t_enter = std::max(0.0, (enter - ray.way) / ray.per_t);
  const double exit = walk.crossing<true>(enter);
  if (exit != kNowhere) hit.t_exit = (exit - ray.way) / ray.per_t;
  return hit;
}

std::vector<ReferenceHit> exact_hits(const ReferenceTracer& tracer, const FrameUniforms& frame, Wrap wrap,
                                     std::span<const ScorePixel> pixels, const Mesh* mesh) {
  if (!is_curved(frame.surface_kind())) return exact_hits(tracer, pixels);
  if (frame.surface_kind() == SurfaceKind::mesh)
    return exact_hits_on_mesh(MeshFrame(tracer, *mesh, frame), frame, pixels);
  const SurfaceShape shape(frame);
  std::vector<ReferenceHit> hits(pixels.size());
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    if (pixels[i].status != static_cast<float>(PixelStatus::no_ray))
      hits[i] = trace_surface(tracer, shape, surface_ray(frame, shape, wrap, x, y), wrap);
  });
  return hits;
}

std::vector<float> exact_light(const ReferenceTracer& tracer, const LightSource& light, const FrameUniforms& frame,
                               std::span<const ReferenceHit> hits) {
  const SurfaceShape shape(frame);
  std::vector<Point3> directions = light_directions(light);
  for (Point3& direction : directions) {
    const double length = std::hypot(direction[0], direction[1], direction[2]);
    for (double& part : direction) part /= length;
  }
  std::vector<float> shares(hits.size());
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    const SurfaceRay ray = surface_ray(frame, shape, tracer.wrap(), x, y);
    if (!ray.enters || hits[i].passes()) return;
    Point3 from = ray.at(hits[i].t_enter);
    const Point3 normal = shape.place_of(from).normal;
    for (std::size_t axis = 0; axis < 3; ++axis) from.at(axis) += kLightLift * shape.relief * normal.at(axis);
    const auto lit = std::ranges::count_if(directions, [&](const Point3& direction) {
      const SurfaceRay way{.from = from, .direction = direction};
      return SurfaceWalk(tracer, shape, way, tracer.wrap()).crossing<false>(0) == kNowhere;
    });
    shares[i] = static_cast<float>(static_cast<double>(lit) / static_cast<double>(directions.size()));
  });
  return shares;
}

PixelScores judge_pixels(const FrameUniforms& frame, Wrap wrap, std::span<const ScorePixel> pixels,
                         std::span<const ReferenceHit> exact) {
  if (!is_curved(frame.surface_kind())) return judge_pixels(pixels, exact, frame.sizes[2], frame.sizes[3]);
  PixelScores scores(pixels.size());
  if (frame.surface_kind() == SurfaceKind::mesh) {
    std::ranges::transform(pixels, exact, scores.begin(), [&](const ScorePixel& pixel, const ReferenceHit& hit) {
      return score_on_mesh(pixel, hit, frame);
    });
    return scores;
  }
  const SurfaceShape shape(frame);
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    const bool has_ray = pixels[i].status != static_cast<float>(PixelStatus::no_ray);
    scores[i] = has_ray
                    ? score_on_surface(shape, surface_ray(frame, shape, wrap, x, y), pixels[i], exact[i], frame, wrap)
                    : PixelScore{};
  });
  return scores;
}

JudgedFrame judge(const FrameUniforms& frame, Wrap wrap, bool is_solid, std::span<const ScorePixel> pixels,
                  std::span<const ReferenceHit> exact) {
  if (!is_curved(frame.surface_kind())) return judge(pixels, exact, frame.sizes[2], frame.sizes[3], is_solid);
  return judge(pixels, judge_pixels(frame, wrap, pixels, exact), kOfSilhouette);
}

}  // namespace reliefbench
