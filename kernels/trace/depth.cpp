#include "kernels/trace/depth.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>

#include "kernels/judge/depth_range.h"
#include "kernels/trace/each_pixel.h"
#include "kernels/trace/surface.h"

namespace reliefbench {
namespace {

using EyeVector = std::array<double, 3>;

constexpr double kNoDepth = std::numeric_limits<double>::infinity();
constexpr double kDepthUlp = 0x1p-24;        // of numbers under 1
constexpr double kMostDepthUlps = 4;         // of a depth whose ray is exact
constexpr double kDirectionError = 0x1p-22;  // of a direction's part, for each unit that is added up in it

double eye_dot(const EyeVector& a, const EyeVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

EyeVector eye_direction(const FrameUniforms& frame, int x, int y) {
  const double right = (x + 0.5) / frame.sizes[0] * 2 - 1;
  const double down = (y + 0.5) / frame.sizes[1] * 2 - 1;
  EyeVector direction{};
  for (std::size_t i = 0; i < 3; ++i)
    direction.at(i) = static_cast<double>(frame.forward.at(i)) + static_cast<double>(frame.right.at(i)) * right -
                      static_cast<double>(frame.up.at(i)) * down;
  return direction;
}

/// From the eye to the point of the scene that is so far from the one that the camera looks at.
EyeVector way_from_eye(const FrameUniforms& frame, const EyeVector& offset) {
  const double distance = static_cast<double>(frame.up[3]) / kNearPlane;
  EyeVector way{};
  for (std::size_t i = 0; i < 3; ++i) way.at(i) = static_cast<double>(frame.forward.at(i)) * distance + offset.at(i);
  return way;
}

double relief_height(const FrameUniforms& frame) {
  return static_cast<double>(frame.position[3]) / static_cast<double>(frame.right[3]);
}

double square_depth(const FrameUniforms& frame, const EyeVector& direction) {
  const double relief = relief_height(frame);
  const double rise = relief / kSquareSide;
  const EyeVector middle = way_from_eye(frame, {-kSquareSide, 0, -0.5 * relief});
  const double depth = (middle[2] - rise * middle[0]) / (direction[2] - rise * direction[0]);
  const bool is_inside = std::abs(direction[0] * depth - middle[0]) <= kSquareSide / 2 &&
                         std::abs(direction[1] * depth - middle[1]) <= kSquareSide / 2;
  if (!is_inside) return kNoDepth;
  return depth;
}

double ball_depth(const FrameUniforms& frame, const EyeVector& direction) {
  const EyeVector middle = way_from_eye(frame, {kBallRadius, 0, -0.5 * relief_height(frame)});
  const double a = eye_dot(direction, direction);
  const double nearest = eye_dot(direction, middle) / a;
  EyeVector beside{};
  for (std::size_t i = 0; i < 3; ++i) beside.at(i) = middle.at(i) - direction.at(i) * nearest;
  const double inside = kBallRadius * kBallRadius - eye_dot(beside, beside);
  return inside < 0 ? kNoDepth : nearest - std::sqrt(inside / a);
}

}  // namespace

PixelDepths pixel_depths(const FrameUniforms& frame, Wrap wrap, int x, int y) {
  if (is_curved(frame.surface_kind())) {
    const SurfaceRay ray = surface_ray(frame, SurfaceShape(frame), wrap, x, y);
    const EyeVector direction = eye_direction(frame, x, y);
    const double length = std::sqrt(eye_dot(direction, direction));
    if (!ray.enters) return {.relief = relief_height(frame)};
    return {.fall = ray.cosine * length,
            .height = ray.way * ray.cosine,
            .relief = relief_height(frame),
            .way_blur = ray.way_blur / length,
            .fall_blur = ray.cosine_blur * length};
  }
  return {.fall = -eye_direction(frame, x, y)[2],
          .height = static_cast<double>(frame.position[2]),
          .relief = relief_height(frame)};
}

double window_depth(const FrameUniforms& frame, double depth) {
  const auto near = static_cast<double>(frame.up[3]);
  if (!(depth > near)) return 0;
  return std::min((1 - near / depth) * kDepthRange / (kDepthRange - 1), static_cast<double>(kFarthest));
}

std::vector<float> exact_depth(const FrameUniforms& frame, Wrap wrap, std::span<const ReferenceHit> hits) {
  std::vector<float> depths(hits.size());
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    const PixelDepths pixel = pixel_depths(frame, wrap, x, y);
    const bool is_seen = pixel.fall > 0 && !hits[i].passes();
    depths[i] = is_seen ? static_cast<float>(window_depth(frame, pixel.at(hits[i].t_enter))) : kFarthest;
  });
  return depths;
}

std::int64_t wrong_depths(const FrameUniforms& frame, Wrap wrap, std::span<const ScorePixel> pixels,
                          std::span<const float> depths) {
  assert(pixels.size() == depths.size());
  const auto near = static_cast<double>(frame.up[3]);
  const double parts = std::abs(static_cast<double>(frame.forward[2])) + std::abs(static_cast<double>(frame.right[2])) +
                       std::abs(static_cast<double>(frame.up[2]));
  std::atomic<std::int64_t> count = 0;
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    if (pixels[i].status == static_cast<float>(PixelStatus::no_ray)) return;
    const PixelDepths pixel = pixel_depths(frame, wrap, x, y);
    if (pixel.fall <= pixel.fall_blur) return;  // a ray by rounding alone
    const auto t = static_cast<double>(pixels[i].t);
    const double down = pixel.height + t * pixel.relief;
    const double sum = std::abs(pixel.height) + t * pixel.relief;
    // Of 1 - near * fall / down, where fall and down are rounded.
    const double blur = pixel.fall * pixel.blur_at(t);
    const double least = std::max(down - blur, kDepthUlp * sum);
    const double slack =
        kMostDepthUlps * kDepthUlp +
        near / least * (kDirectionError * parts + pixel.fall * (blur + kMostDepthUlps * kDepthUlp * sum) / least);
    const auto found = static_cast<double>(depths[i]);
    const bool is_own = std::abs(found - window_depth(frame, pixel.at(t))) <= slack;
    const bool is_behind_plate = found >= window_depth(frame, pixel.at(0)) - slack;
    if (!is_own || !is_behind_plate) ++count;
  });
  return count;
}

std::vector<SeenObject> exact_visibility(const FrameUniforms& frame, Wrap wrap, std::span<const ReferenceHit> hits) {
  std::vector<SeenObject> seen(hits.size(), SeenObject::relief);
  const auto near = static_cast<double>(frame.up[3]);
  for_each_pixel(frame, [&](std::size_t i, int x, int y) {
    const EyeVector direction = eye_direction(frame, x, y);
    const PixelDepths pixel = pixel_depths(frame, wrap, x, y);
    double nearest = pixel.fall > 0 ? pixel.at(hits[i].t_enter) : kNoDepth;
    const auto place = [&](SeenObject object, double depth) {
      if (!(depth >= near && depth < nearest)) return;
      nearest = depth;
      seen[i] = object;
    };
    place(SeenObject::square, square_depth(frame, direction));
    place(SeenObject::ball, ball_depth(frame, direction));
  });
  return seen;
}

}  // namespace reliefbench
