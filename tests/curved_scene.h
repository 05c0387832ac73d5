#pragma once
#include <array>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/trace/surface.h"

namespace reliefbench {

inline constexpr std::array kCurved{SurfaceKind::cylinder, SurfaceKind::sphere, SurfaceKind::torus};

inline Heightfield level_map(float height, int side = 16) {
  return {.width = side, .height = side, .texels = std::vector<float>(static_cast<std::size_t>(side * side), height)};
}

inline Scene curved_scene(SurfaceKind kind, double relief_depth = 0.08, Wrap wrap = Wrap::repeat, int side_px = 48) {
  return {.view = {.id = "whole", .elevation_deg = 35, .distance = 2.6, .fov_deg = 40, .azimuth_deg = 20},
          .relief_depth = relief_depth,
          .wrap = wrap,
          .width_px = side_px,
          .height_px = side_px,
          .surface = {.kind = kind}};
}

}  // namespace reliefbench
