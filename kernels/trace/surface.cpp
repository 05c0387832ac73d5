#include "kernels/trace/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "kernels/mesh/meshes.h"

namespace reliefbench {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

constexpr std::array kSurfaces{
    SurfaceRow{.kind = SurfaceKind::plane,
               .id = "plane",
               .description = "endless, or with clamp the unit square",
               .source = "[RTM] 5.1",
               .shader = ""},
    SurfaceRow{.kind = SurfaceKind::cylinder,
               .id = "cylinder",
               .description = "round along u, straight and endless along v; with clamp the unit square wrapped on it",
               .source = "[RTM] 5.4; its exact hits are ours",
               .shader = "surface_cylinder.glsl",
               .has_round = true},
    SurfaceRow{
        .kind = SurfaceKind::sphere,
        .id = "sphere",
        .description = "longitude along u, latitude along v, its poles on the left and right of the camera's way",
        .source = "[RTM] 5.4, figure 5.22; its exact hits are ours",
        .shader = "surface_sphere.glsl",
        .has_round = true},
    SurfaceRow{.kind = SurfaceKind::torus,
               .id = "torus",
               .description = "round the ring along u, round the tube along v; saddle-shaped on the inside",
               .source = "[RTM] 5.4; its exact hits are ours",
               .shader = "surface_torus.glsl",
               .has_round = true,
               .has_tube = true},
    SurfaceRow{.kind = SurfaceKind::mesh,
               .id = "mesh",
               .description =
                   "triangles with curvature at their corners, 0.45 sides of the unit square from its middle "
                   "at most: teapot, torus, or an OBJ file with vt",
               .source = "[RTM] 5.4, listing 5.8; its exact hits are ours",
               .shader = "surface_mesh.glsl",
               .has_mesh = true}};

double dot3(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point3 on_line(const Point3& from, const Point3& direction, double way) {
  return {from[0] + direction[0] * way, from[1] + direction[1] * way, from[2] + direction[2] * way};
}
bool is_whole(double number) { return std::abs(number - std::round(number)) <= 1e-9 * std::max(1.0, number); }

/// A coordinate whose speed is at most `most` and changes by at most `change` a unit of the way.
Moving moving(double value, double speed, double half, double most, double change) {
  return {.value = value,
          .speed = speed,
          .reach = std::min(std::abs(speed) * half + 0.5 * change * half * half, most * half),
          .sway = std::min(change * half, most + std::abs(speed))};
}

Moving times_plus(const Moving& m, double factor, double offset) {
  return {.value = offset + factor * m.value,
          .speed = factor * m.speed,
          .reach = factor * m.reach,
          .sway = factor * m.sway};
}

/// 1 / x for what is left of a distance; without end where nothing is.
double inverse_of(double distance) {
  if (distance > 0) return 1 / distance;
  return std::numeric_limits<double>::infinity();
}

/// The angle of a turn about an axis: at most half a turn from anywhere.
Moving turning(double value, double speed, double half, double inverse, double change) {
  Moving angle = moving(value, speed, half, inverse, change);
  angle.reach = std::min(angle.reach, kTurn / 2);
  if (!(angle.reach >= 0)) angle.reach = kTurn / 2;  // NaN of a point on the axis
  return angle;
}

}  // namespace

std::span<const SurfaceRow> surfaces() { return kSurfaces; }

const SurfaceRow& surface_row(SurfaceKind kind) { return *std::ranges::find(kSurfaces, kind, &SurfaceRow::kind); }

const SurfaceRow* find_surface(std::string_view id) {
  const auto* const found = std::ranges::find(kSurfaces, id, &SurfaceRow::id);
  return found == kSurfaces.end() ? nullptr : found;
}

std::string surface_fault(const Scene& scene) {
  const SurfaceRow& row = surface_row(scene.surface.kind);
  if (!is_curved(row.kind)) return "";
  if (row.has_mesh)
    return scene.wrap == Wrap::clamp ? "a mesh needs wrap=repeat: where its map ends, its own uv say" : "";
  const double round = scene.surface.round;
  const double tube = scene.surface.tube;
  const double radius = (row.has_tube ? tube : round) / kTurn;
  if (scene.relief_depth / scene.tiling >= radius)
    return fmt::format("a relief of {:.4g} is not less deep than the {}'s radius of {:.4g}",
                       scene.relief_depth / scene.tiling, row.id, radius);
  if (row.has_tube && round <= 2 * tube)
    return fmt::format("a torus needs a ring more than twice as far round as its tube: {} and {}", round, tube);
  if (scene.wrap == Wrap::clamp && (round < 1 || (row.has_tube && tube < 1)))
    return fmt::format("with clamp the {} must be 1 round at least: the unit square lies on it once", row.id);
  if (scene.wrap == Wrap::repeat &&
      !(is_whole(round * scene.tiling) && (!row.has_tube || is_whole(tube * scene.tiling))))
    return fmt::format("the {} has a seam: its rounds times tiling must be whole numbers", row.id);
  return "";
}

std::string surface_text(const Surface& surface) {
  const SurfaceRow& row = surface_row(surface.kind);
  if (!is_curved(row.kind)) return "";
  if (row.has_mesh)
    return find_named_mesh(surface.mesh) == nullptr
               ? fmt::format("mesh {}", std::filesystem::path(surface.mesh).filename().string())
               : fmt::format("mesh {} of {} segments", surface.mesh, surface.segments);
  return fmt::format("{} of {:g} round{}", row.id, surface.round,
                     row.has_tube ? fmt::format(" and {:g} tube", surface.tube) : "");
}

SurfaceShape::SurfaceShape(const FrameUniforms& frame)
    : kind(frame.surface_kind()),
      ring(static_cast<double>(frame.surface[0])),
      tube(static_cast<double>(frame.surface[1])),
      relief(static_cast<double>(frame.position[3]) / static_cast<double>(frame.right[3])),
      tiling(static_cast<double>(frame.right[3])) {}

Located SurfaceShape::locate(const Point3& point, const Point3& direction, double half) const {
  // About the axis, which is parallel to y: the distance from it and the turn from the top towards +x.
  const double x = point[0] - 0.5;
  const double y = point[1] - 0.5;
  const double z = point[2] + ring + tube;
  const double axial = std::hypot(x, z);
  const double axial_speed = axial > 0 ? (x * direction[0] + z * direction[2]) / axial : 0;
  const double axial_inverse = inverse_of(axial - half);
  const Moving turn = turning(std::atan2(x, z), (z * direction[0] - x * direction[2]) / (axial * axial), half,
                              axial_inverse, 2 * axial_inverse * axial_inverse);
  if (kind == SurfaceKind::cylinder)
    return {.height = times_plus(moving(axial, axial_speed, half, 1, axial_inverse), 1 / relief, 1 - tube / relief),
            .u = times_plus(turn, tube, 0.5),
            .v = {.value = point[1], .speed = direction[1], .reach = std::abs(direction[1]) * half}};
  // About the tube's middle, in the plane of the axis and the point.
  const double across = axial - ring;
  const double radial = std::hypot(across, y);
  const double radial_speed = radial > 0 ? (across * axial_speed + y * direction[1]) / radial : 0;
  const double radial_inverse = inverse_of(radial - half);
  // A sphere's radius knows nothing of the axis.
  const double radial_change = radial_inverse + (kind == SurfaceKind::sphere ? 0 : axial_inverse);
  const Moving rise = turning(std::atan2(y, across), (across * direction[1] - y * axial_speed) / (radial * radial),
                              half, radial_inverse, radial_inverse * (2 * radial_inverse + axial_inverse));
  return {.height = times_plus(moving(radial, radial_speed, half, 1, radial_change), 1 / relief, 1 - tube / relief),
          .u = times_plus(turn, ring + tube, 0.5),
          .v = times_plus(rise, tube, 0.5)};
}

SurfacePlace SurfaceShape::place_of(const Point3& point) const {
  const double x = point[0] - 0.5;
  const double y = point[1] - 0.5;
  const double z = point[2] + ring + tube;
  const double axial = std::max(std::hypot(x, z), 1e-12);
  const double sine = x / axial;
  const double cosine = z / axial;
  if (kind == SurfaceKind::cylinder)
    return {.normal = {sine, 0, cosine},
            .tangent_u = {cosine, 0, -sine},
            .tangent_v = {0, 1, 0},
            .scale = {1, 1},
            .curvature = {1 / tube, 0}};
  const double across = axial - ring;
  const double radial = std::max(std::hypot(across, y), 1e-12);
  const double rise = y / radial;
  const double level = across / radial;  // may be negative on a torus' inside
  const double around = ring + tube * level;
  return {.normal = {level * sine, rise, level * cosine},
          .tangent_u = {cosine, 0, -sine},
          .tangent_v = {-rise * sine, level, -rise * cosine},
          .scale = {std::max(around / (ring + tube), kLeastScale), 1},
          .curvature = {kind == SurfaceKind::sphere ? 1 / tube : level / around, 1 / tube}};
}

double SurfaceShape::enter(const Point3& from, const Point3& direction) const {
  // Of a cylinder only what is across its axis counts.
  const double along = kind == SurfaceKind::cylinder ? 0 : 1;
  const Point3 to_eye{from[0] - 0.5, along * (from[1] - 0.5), from[2] + ring + tube};
  const Point3 across{direction[0], along * direction[1], direction[2]};
  const double a = dot3(across, across);
  if (a == 0) return -1;
  const double nearest = -dot3(to_eye, across) / a;
  const Point3 beside = on_line(to_eye, across, nearest);
  const double reach = ring + tube;  // of a torus: the sphere round it
  const double inside = reach * reach - dot3(beside, beside);
  if (inside < 0) return -1;
  const double half = std::sqrt(inside / a);
  if (kind != SurfaceKind::torus) return nearest - half;
  // Sphere tracing: nowhere is the way to the tube shorter than its distance. Near the tube Newton's steps, as spheres
  // of a grazing ray come no nearer. Where the ray moves away there is a least step, within which it could pass what is
  // no deeper than the step's square.
  double way = std::max(nearest - half, 0.0);
  double outside = way;  // the last place that was
  constexpr int kMostSteps = 4096;
  const double arrived = 1e-13 + 4e-15 * reach;  // over what rounding does to the distance
  constexpr double kClose = 1e-3;                // of the reach
  constexpr double kLeast = 1e-6;
  for (int i = 0; i < kMostSteps && way <= nearest + half; ++i) {
    const Point3 p = on_line(to_eye, direction, way);
    const double axial = std::max(std::hypot(p[0], p[2]), 1e-12);
    const double radial = std::max(std::hypot(axial - ring, p[1]), 1e-12);
    const double distance = radial - tube;
    const double axial_speed = (p[0] * direction[0] + p[2] * direction[2]) / axial;
    const double fall = -((axial - ring) * axial_speed + p[1] * direction[1]) / radial;
    if (i == 0 && distance < 0 && way == 0) return -1;
    if (std::abs(distance) <= arrived) return way;
    if (distance > 0) outside = way;
    const bool is_close = distance <= kClose * reach;
    if (distance < 0 && fall <= 0)
      way = 0.5 * (outside + way);
    else if (is_close && fall > 0)
      way += std::min(distance / fall, 0.1 * tube);
    else
      way += is_close ? std::max(distance, kLeast * reach) : distance;
  }
  return -1;
}

namespace {

constexpr double kRounding = 0x1p-24;

/// What surface_frame.glsl knows of a ray that is exactly this one: in floats it passes beside it, and so enters
/// elsewhere, where the surface is turned. parts: the lengths that eye_direction() adds up, of a ray of length 1
void blur_ray(SurfaceRay& ray, const SurfaceShape& shape, const SurfacePlace& place, double parts) {
  const double outer = shape.ring + shape.tube;
  const double eye = std::hypot(ray.from[0] - 0.5, ray.from[1] - 0.5, ray.from[2] + outer);
  // Roundings, with quotients of 2.5 ulp and roots of 4.5 as Vulkan allows. Of the distance from the surface: the eye
  // from the surface's middle (2 of it); the way as the direction has it (4 for each part) and its product (1), where a
  // torus' Newton steps end (4 of way and radius); sums on the surface (4 of the radius) and two lengths (11 each). Of
  // the way, which counts by the cosine: to the point nearest to the middle (two products of 3, a quotient, a sum).
  const double off = kRounding * (2 * eye + (5 + 4 * parts) * ray.way + 30 * outer + 12 * eye * ray.cosine);
  // The surface is a parabola over the ray's way, at most so curved.
  const double curvature = std::max(std::abs(place.curvature[0]), std::abs(place.curvature[1]));
  const double square = ray.cosine * ray.cosine - 2 * curvature * off;
  // Of the normal itself (two turns of a length and a quotient, 16 each, and their product), of the direction and of
  // the product of both (3).
  const double turned = kRounding * (36 + 4 * parts) + curvature * off;
  ray.way_blur = 2 * off / (ray.cosine + std::sqrt(std::max(square, 0.0)));
  ray.cosine_blur = curvature * ray.way_blur + turned;
  if (!(square > 0) || ray.cosine_blur >= ray.cosine) {
    ray.way_blur = ray.cosine_blur = ray.bend_blur = std::numeric_limits<double>::infinity();
    return;
  }
  // The bend is a curvature times a square of a tangent's part over the cosine. The part turns as the normal does (2);
  // so does a ring's curvature, by 1 + tube * curvature.
  const double least = ray.cosine - ray.cosine_blur;
  const double most = 0.5 * shape.relief * curvature / (least * least);
  const double sine_square = 1 - ray.cosine * ray.cosine;
  ray.bend_blur = most * (sine_square * (1 - least * least / (ray.cosine * ray.cosine)) +
                          (3 + shape.tube * curvature) * ray.cosine_blur);
}

}  // namespace

Point3 SurfaceRay::at(double t) const { return on_line(from, direction, way + t * per_t); }

SurfaceRay surface_ray(const FrameUniforms& frame, const SurfaceShape& shape, Wrap wrap, int x, int y) {
  const double right = (x + 0.5) / frame.sizes[0] * 2 - 1;
  const double down = (y + 0.5) / frame.sizes[1] * 2 - 1;
  SurfaceRay ray;
  for (std::size_t i = 0; i < 3; ++i) {
    ray.from.at(i) = static_cast<double>(frame.position.at(i));
    ray.direction.at(i) = static_cast<double>(frame.forward.at(i)) + static_cast<double>(frame.right.at(i)) * right -
                          static_cast<double>(frame.up.at(i)) * down;
  }
  const double length = std::sqrt(dot3(ray.direction, ray.direction));
  for (double& part : ray.direction) part /= length;
  ray.way = shape.enter(ray.from, ray.direction);
  if (!(ray.way >= 0)) return ray;
  const Point3 point = on_line(ray.from, ray.direction, ray.way);
  const Located located = shape.locate(point, ray.direction, 0);
  const SurfacePlace place = shape.place_of(point);
  ray.uv[0] = located.u.value;
  ray.uv[1] = located.v.value;
  ray.cosine = -dot3(ray.direction, place.normal);
  if (!(ray.cosine > 0)) return ray;
  if (wrap == Wrap::clamp && (std::min(ray.uv[0], ray.uv[1]) < 0 || std::max(ray.uv[0], ray.uv[1]) > 1)) return ray;
  const double across[2] = {dot3(ray.direction, place.tangent_u) / ray.cosine,
                            dot3(ray.direction, place.tangent_v) / ray.cosine};
  for (std::size_t i = 0; i < 2; ++i) {
    ray.slope[i] = across[i] / place.scale.at(i) * static_cast<double>(frame.position[3]);
    ray.bend += 0.5 * shape.relief * place.curvature.at(i) * across[i] * across[i];
  }
  ray.per_t = shape.relief / ray.cosine;
  ray.enters = true;
  const auto length_of = [](const std::array<float, 4>& part) {
    return std::hypot(static_cast<double>(part[0]), static_cast<double>(part[1]), static_cast<double>(part[2]));
  };
  blur_ray(ray, shape, place, (1 + length_of(frame.right) + length_of(frame.up)) / length);
  return ray;
}

}  // namespace reliefbench
