#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "kernels/image/heightfield.h"
#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// A camera that looks at the centre of the unit square of a relief-mapped plane, the polygon.
struct View {
  std::string id;
  double elevation_deg = 30;  ///< 90 = straight down
  double distance = 1.5;      ///< from camera to the look-at point, in sides of the unit square
  double fov_deg = 45;        ///< vertical
  double azimuth_deg = 0;     ///< camera turned about the look-at point, anticlockwise from above; 0: looks along +y

  bool operator==(const View&) const = default;
};
/// top, oblique (30 degrees), grazing (8 degrees), horizon.
[[nodiscard]] std::span<const View> view_presets();

/// The one light, a disc infinitely far away.
struct Light {
  double elevation_deg = 53.13010235415598;  ///< of its middle above the plane: the sine is 0.8
  double azimuth_deg = 143.13010235415598;   ///< anticlockwise from +x, from above: (-0.8, 0.6) on the plane
  double angular_radius_deg = 0;             ///< 0: a point

  bool operator==(const Light&) const = default;
};

/// Sizes of frames that go by a name.
struct FrameSize {
  std::string_view id;
  int width_px;
  int height_px;
};
inline constexpr std::array kFrameSizes{
    FrameSize{.id = "720p", .width_px = 1280, .height_px = 720},
    FrameSize{.id = "1080p", .width_px = 1920, .height_px = 1080},
    FrameSize{.id = "1440p", .width_px = 2560, .height_px = 1440},
    FrameSize{.id = "4k", .width_px = 3840, .height_px = 2160},
};
[[nodiscard]] const FrameSize* find_frame_size(std::string_view id);  ///< null: no such name

/// What pictures are compared with.
enum class Picture {
  point,           ///< the exact hits of the rays that frames have, one through each pixel's middle
  supersampled,    ///< of 16 rays a pixel, each shaded: what no pixel is too coarse for, so that aliasing is an error
  point_complete,  ///< of either, with every feature that light and surface have, whether a setting has it or not:
  supersampled_complete,  ///< what a feature brings is less error
};
struct PictureRow {
  Picture kind;
  std::string_view id;
  bool is_supersampled;
  bool is_complete;
};
inline constexpr std::array kPictures{PictureRow{Picture::point, "point", false, false},
                                      PictureRow{Picture::supersampled, "supersampled", true, false},
                                      PictureRow{Picture::point_complete, "point_complete", false, true},
                                      PictureRow{Picture::supersampled_complete, "supersampled_complete", true, true}};
[[nodiscard]] const PictureRow& picture_row(Picture picture);
[[nodiscard]] inline std::string_view picture_id(Picture picture) { return picture_row(picture).id; }

/// What the relief lies on; surface.h has the rows.
enum class SurfaceKind { plane, cylinder, sphere, torus, mesh };
struct Surface {
  SurfaceKind kind = SurfaceKind::plane;
  double round = 4;             ///< sides of the unit square once round it: the larger, the flatter
  double tube = 1;              ///< a torus': once round its tube
  std::string mesh = "teapot";  ///< a named one (meshes.h), or an OBJ file
  int segments = 8;             ///< how finely a named one is cut
  std::string sha256{};         ///< of the mesh as it was read (mesh_sha256); "": it was not

  bool operator==(const Surface&) const = default;
};
/// Least length of a side of the unit square on a surface, of its own: at a sphere's poles there is none.
inline constexpr double kLeastScale = 1.0 / 1024;

/// How the relief lies in the picture.
struct Scene {
  View view;
  double relief_depth = 0.1;  ///< depth of the relief in sides of one tile
  double tiling = 1;          ///< tiles along a side of the unit square
  double pan = 0;             ///< how far camera and look-at point are moved along u, in sides of the unit square
  Wrap wrap = Wrap::repeat;   ///< repeat: the plane goes on for ever; clamp: it ends at the unit square
  int width_px = 256;
  int height_px = 256;
  Light light{};
  Picture reference = Picture::point;
  double occluded = 0;  ///< share of the frame, from its left, that something right before the eye hides; drawn first
  Surface surface{};
  double base = 1;  ///< height of the relief in the polygon's plane: 1, it goes down from there; 0, up; else both

  /// How far the top plate is over the polygon, in sides of the unit square.
  [[nodiscard]] double above() const {
    return surface.kind == SurfaceKind::plane ? (1 - base) * relief_depth / tiling : 0;
  }
};

/// Whether draws of such a scene do not cover the frame, or one another: something hides the relief, or its surface is
/// of triangles.
[[nodiscard]] inline bool needs_depth(const Scene& scene) {
  return scene.occluded > 0 || scene.surface.kind == SurfaceKind::mesh;
}
/// Why a scene's base cannot be, "" if it can: on what is curved, all are 1.
[[nodiscard]] std::string base_fault(const Scene& scene);
/// Why its camera cannot see it, "" if it can: inside of what reaches over the polygon.
[[nodiscard]] std::string camera_fault(const Scene& scene);

/// The uniform block `Frame` of frame.glsl, std140.
struct FrameUniforms {
  std::array<float, 4> position;      ///< xyz, the top plate at z = 0, w = relief depth
  std::array<float, 4> right;         ///< xyz scaled by aspect * tan(fov/2), w = tiling
  std::array<float, 4> up;            ///< xyz scaled by tan(fov/2), w = near plane, in sides of the unit square
  std::array<float, 4> forward;       ///< xyz, unit; w = argument()
  std::array<float, 4> light;         ///< xyz, towards the light; w = tangent of its angular radius
  std::array<std::int32_t, 4> sizes;  ///< frame width, height in px; map width, height in texels
  std::array<float, 4> surface;       ///< radius of a torus' ring, or 0; radius; Scene::above(); SurfaceKind

  /// What one draw is told beside: the occluder its share of the frame, objects.frag which one it is, a pass of several
  /// its place.
  [[nodiscard]] float& argument() { return forward[3]; }
  [[nodiscard]] SurfaceKind surface_kind() const { return static_cast<SurfaceKind>(static_cast<int>(surface[3])); }
  bool operator==(const FrameUniforms&) const = default;
};
static_assert(sizeof(FrameUniforms) == 112);
[[nodiscard]] FrameUniforms frame_uniforms(const Scene& scene, int map_width, int map_height);

/// The same camera with every ray through another point of its pixel. x, y: from the middle, px; rows from the top
[[nodiscard]] FrameUniforms shifted(const FrameUniforms& frame, double x_px, double y_px);
inline constexpr int kSubpixels = 4;  ///< a side, of a supersampled Picture

/// How many pixels of the frame a texel of the map's smaller side covers in the middle of the picture, along the way
/// that rays travel: what a hit that is off by a texel is off by as people see it.
[[nodiscard]] double texel_px(const Scene& scene, int map_width, int map_height);

/// The ray of one pixel, as frame.glsl makes it (same formulas in float; used by the null backend and by tests), or on
/// a curved surface surface_frame.glsl (in double). status is no_ray for the sky and, with clamp, outside the unit
/// square. Of a mesh, which frames do not have in numbers, there is none.
[[nodiscard]] ScorePixel pixel_ray(const FrameUniforms& frame, Wrap wrap, int x, int y);

}  // namespace reliefbench
