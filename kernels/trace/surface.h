#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "kernels/trace/view.h"

namespace reliefbench {

/// A surface that the relief lies on: one row, and its file of kernels/shaders. What is given is the top plate, of
/// height 1; the relief goes inwards along the normal: p(u, v) + (h - 1) relief_depth n(u, v).
struct SurfaceRow {
  SurfaceKind kind;
  std::string_view id;
  std::string_view description;
  std::string_view source;
  std::string_view shader;  ///< kernels/shaders/<shader>: `enter`, `place_of`; "": frame.glsl has it
  bool has_round = false;   ///< which of Surface's numbers mean something
  bool has_tube = false;
  bool has_mesh = false;
};
[[nodiscard]] std::span<const SurfaceRow> surfaces();
[[nodiscard]] const SurfaceRow& surface_row(SurfaceKind kind);
/// Null: no such surface.
[[nodiscard]] const SurfaceRow* find_surface(std::string_view id);
[[nodiscard]] inline bool is_curved(SurfaceKind kind) { return kind != SurfaceKind::plane; }

/// Why a scene's surface cannot be as it is said, "" if it can: a relief that is deeper than the surface is round, a
/// seam, a tube as wide as its ring.
[[nodiscard]] std::string surface_fault(const Scene& scene);
/// "sphere of 4 round" for people; "" for a plane.
[[nodiscard]] std::string surface_text(const Surface& surface);

using Point3 = std::array<double, 3>;

/// A coordinate of a point on a stretch of a straight line that it follows at speed 1: value and speed in the middle,
/// and bounds on how far they are from these anywhere on the stretch.
struct Moving {
  double value = 0;
  double speed = 0;
  double reach = 0;  ///< of `value`
  double sway = 0;   ///< of `speed`
};
/// A point as the surface has it: its height, 1 on the top plate, and where it stands, in sides of the unit square.
struct Located {
  Moving height;
  Moving u;
  Moving v;
};

/// What stands where on a top plate.
struct SurfacePlace {
  Point3 normal{};
  Point3 tangent_u{};  ///< unit
  Point3 tangent_v{};
  std::array<double, 2> scale{1, 1};      ///< lengths of a side of the unit square along them
  std::array<double, 2> curvature{0, 0};  ///< along them, of the normal section: > 0 where the surface bends away
};

/// A curved surface in numbers, in sides of the unit square. It touches z = 0 from below at the middle of the unit
/// square, which is its (u, v) = (1/2, 1/2) with u along x and v along y. No mesh: of those see mesh_frame.h.
struct SurfaceShape {
  explicit SurfaceShape(const FrameUniforms& frame);

  SurfaceKind kind;
  double ring;    ///< from the torus' axis to its tube's middle; 0: none
  double tube;    ///< radius
  double relief;  ///< depth
  double tiling;

  /// point: the middle of a stretch of a line; half: half its length; direction: unit
  [[nodiscard]] Located locate(const Point3& point, const Point3& direction, double half) const;
  [[nodiscard]] SurfacePlace place_of(const Point3& point) const;
  /// The way to where a ray comes in at the top plate from outside; negative: it does not, or begins inside.
  [[nodiscard]] double enter(const Point3& from, const Point3& direction) const;
};

/// The ray of a pixel in the world and where it meets the top plate. C++ twin of surface_frame.glsl.
struct SurfaceRay {
  bool enters = false;
  Point3 from{};
  Point3 direction{};  ///< unit
  double way = 0;      ///< to where it enters
  double uv[2]{};      ///< there, in sides of the unit square
  double cosine = 0;   ///< of the angle to the normal there
  double slope[2]{};   ///< tiles per height in the plane that touches there
  double bend = 0;     ///< how fast the surface bends away below the ray: height 1 - t + bend t^2
  double per_t = 0;    ///< the way that belongs to t = 1
  /// What floats may have wrong of the above: of the way, of the cosine, of the bend. Without end where they do not
  /// tell whether the ray enters at all.
  double way_blur = 0;
  double cosine_blur = 0;
  double bend_blur = 0;

  [[nodiscard]] Point3 at(double t) const;
};
[[nodiscard]] SurfaceRay surface_ray(const FrameUniforms& frame, const SurfaceShape& shape, Wrap wrap, int x, int y);

}  // namespace reliefbench
