#include "kernels/trace/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/judge/depth_range.h"
#include "kernels/trace/surface.h"

namespace reliefbench {

namespace {

/// Radius of the ring and of the tube, what is over the polygon, then the kind.
std::array<float, 4> surface_numbers(const Scene& scene) {
  const Surface& surface = scene.surface;
  if (!is_curved(surface.kind)) return {0, 0, static_cast<float>(scene.above()), 0};
  if (surface.kind == SurfaceKind::mesh) return {0, 0, 0, static_cast<float>(surface.kind)};
  const double outer = surface.round / (2 * std::numbers::pi);
  const double tube = surface_row(surface.kind).has_tube ? surface.tube / (2 * std::numbers::pi) : outer;
  return {static_cast<float>(outer - tube), static_cast<float>(tube), 0, static_cast<float>(surface.kind)};
}

}  // namespace

std::span<const View> view_presets() {
  static const std::array<View, 4> presets = {
      View{.id = "top", .elevation_deg = 90, .distance = 1.2, .fov_deg = 45},
      View{.id = "oblique", .elevation_deg = 30, .distance = 1.6, .fov_deg = 35},
      // The field of view is narrow, so that the whole frame looks at the relief: 3 to 13 degrees.
      View{.id = "grazing", .elevation_deg = 8, .distance = 5, .fov_deg = 10},
      View{.id = "horizon", .elevation_deg = 8, .distance = 2, .fov_deg = 50},
  };
  return presets;
}

const FrameSize* find_frame_size(std::string_view id) {
  const auto* const found = std::ranges::find(kFrameSizes, id, &FrameSize::id);
  return found == kFrameSizes.end() ? nullptr : found;
}

namespace {

/// xyz, and the tangent of the angular radius.
std::array<double, 4> light_of(const Light& light) {
  const double degree = std::numbers::pi / 180;
  // cos(90 degrees) must be 0, so that the light stands right above.
  const double level = std::abs(light.elevation_deg) == 90 ? 0.0 : std::cos(light.elevation_deg * degree);
  return {level * std::cos(light.azimuth_deg * degree), level * std::sin(light.azimuth_deg * degree),
          std::sin(light.elevation_deg * degree), std::tan(light.angular_radius_deg * degree)};
}

}  // namespace

FrameUniforms frame_uniforms(const Scene& scene, int map_width, int map_height) {
  const double elevation = scene.view.elevation_deg * std::numbers::pi / 180;
  // cos(90 degrees) must be 0, so that `top` looks straight down.
  const double c = scene.view.elevation_deg == 90 ? 0.0 : std::cos(elevation);
  const double s = std::sin(elevation);
  const double half = std::tan(scene.view.fov_deg * std::numbers::pi / 360);
  const double aspect = static_cast<double>(scene.width_px) / scene.height_px;
  const auto f = [](double value) { return static_cast<float>(value); };
  const double azimuth = scene.view.azimuth_deg * std::numbers::pi / 180;
  const auto [light_x, light_y, light_z, light_radius] = light_of(scene.light);
  const auto turned = [&, cosine = std::cos(azimuth), sine = std::sin(azimuth)](double x, double y) {
    return std::array{x * cosine - y * sine, x * sine + y * cosine};
  };
  // Before it is turned, the camera looks along +y and down at (1/2 + pan, 1/2, 0), and right is +x.
  const auto [position_x, position_y] = turned(0, -scene.view.distance * c);
  const auto [right_x, right_y] = turned(aspect * half, 0);
  const auto [up_x, up_y] = turned(0, s * half);
  const auto [forward_x, forward_y] = turned(0, c);
  return {.position = {f(0.5 + scene.pan + position_x), f(0.5 + position_y), f(scene.view.distance * s - scene.above()),
                       f(scene.relief_depth)},
          .right = {f(right_x), f(right_y), 0, f(scene.tiling)},
          .up = {f(up_x), f(up_y), f(c * half), f(kNearPlane * scene.view.distance)},
          .forward = {f(forward_x), f(forward_y), f(-s), 0},
          .light = {f(light_x), f(light_y), f(light_z), f(light_radius)},
          .sizes = {scene.width_px, scene.height_px, map_width, map_height},
          .surface = surface_numbers(scene)};
}

std::string base_fault(const Scene& scene) {
  if (scene.base == 1 || !is_curved(scene.surface.kind)) return "";
  return fmt::format("base needs a plane, not a {}", surface_row(scene.surface.kind).id);
}

std::string camera_fault(const Scene& scene) {
  const double height = scene.view.distance * std::sin(scene.view.elevation_deg * std::numbers::pi / 180);
  if (scene.base == 1 || height > scene.above()) return "";
  return fmt::format(
      "the camera is inside the relief: {:.4g} over the polygon, "
      "over which a relief {:.4g} deep of base {:.4g} reaches {:.4g}",
      height, scene.relief_depth, scene.base, scene.above());
}

const PictureRow& picture_row(Picture picture) { return kPictures.at(static_cast<std::size_t>(picture)); }

FrameUniforms shifted(const FrameUniforms& frame, double x_px, double y_px) {
  FrameUniforms moved = frame;
  const double across = 2 * x_px / frame.sizes[0];
  const double down = 2 * y_px / frame.sizes[1];
  for (std::size_t i = 0; i < 3; ++i)
    moved.forward.at(i) =
        static_cast<float>(static_cast<double>(frame.forward.at(i)) + across * static_cast<double>(frame.right.at(i)) -
                           down * static_cast<double>(frame.up.at(i)));
  return moved;
}

double texel_px(const Scene& scene, int map_width, int map_height) {
  const double degree = std::numbers::pi / 180;
  const double visible_sides = 2 * std::tan(scene.view.fov_deg * degree / 2) * scene.view.distance;
  const double side_px = scene.height_px / visible_sides * std::abs(std::sin(scene.view.elevation_deg * degree));
  return side_px / (scene.tiling * std::min(map_width, map_height));
}

namespace {

ScorePixel pixel_of(const SurfaceRay& ray, Wrap wrap, double tiling) {
  if (!ray.enters) return {};
  const auto uv = [&](double side) {
    const double tiles = side * tiling;
    return static_cast<float>(wrap == Wrap::repeat ? tiles - std::floor(tiles) : tiles);
  };
  return {.ray = {.u = uv(ray.uv[0]),
                  .v = uv(ray.uv[1]),
                  .slope_u = static_cast<float>(ray.slope[0]),
                  .slope_v = static_cast<float>(ray.slope[1])},
          .status = static_cast<float>(PixelStatus::hit)};
}

}  // namespace

ScorePixel pixel_ray(const FrameUniforms& frame, Wrap wrap, int x, int y) {
  if (frame.surface_kind() == SurfaceKind::mesh) return {};
  if (is_curved(frame.surface_kind())) {
    const SurfaceShape shape(frame);
    return pixel_of(surface_ray(frame, shape, wrap, x, y), wrap, shape.tiling);
  }
  const std::array<float, 2> ndc = {(static_cast<float>(x) + 0.5F) / static_cast<float>(frame.sizes[0]) * 2.0F - 1.0F,
                                    (static_cast<float>(y) + 0.5F) / static_cast<float>(frame.sizes[1]) * 2.0F - 1.0F};
  std::array<float, 3> direction{};
  for (std::size_t i = 0; i < 3; ++i)
    direction.at(i) = frame.forward.at(i) + frame.right.at(i) * ndc[0] - frame.up.at(i) * ndc[1];
  if (direction[2] >= 0) return {};
  std::array<float, 2> per_height{};
  std::array<float, 2> uv{};
  for (std::size_t i = 0; i < 2; ++i) {
    per_height.at(i) = direction.at(i) / -direction[2];
    const float polygon = frame.position.at(i) + per_height.at(i) * (frame.position[2] + frame.surface[2]);
    if (wrap == Wrap::clamp && (polygon < 0 || polygon > 1)) return {};
    const float plane = frame.position.at(i) + per_height.at(i) * frame.position[2];
    uv.at(i) = plane * frame.right[3];
    if (wrap == Wrap::repeat) uv.at(i) -= std::floor(uv.at(i));
  }
  return {.ray = {.u = uv[0],
                  .v = uv[1],
                  .slope_u = per_height[0] * frame.position[3],
                  .slope_v = per_height[1] * frame.position[3]},
          .status = static_cast<float>(PixelStatus::hit)};
}

}  // namespace reliefbench
