// A frame on a curved surface, in place of frame.glsl: its camera, and the rays of its pixels, which are straight in
// the world and go on in the plane that touches the surface where they enter. `surface.glsl` is the surface's own file.
#define CURVED
#define MAY_PASS
#include "common.glsl"
#include "frame_block.glsl"

// What stands where on a surface.
struct Place {
  vec3 normal;
  vec3 tangent_u;  // unit
  vec3 tangent_v;
  vec2 uv;         // in sides of the unit square
  vec2 scale;      // lengths of such sides along the tangents
  vec2 curvature;  // along them; > 0 where the surface bends away from the eye
  float height;    // 1 on the top plate
#ifdef ON_MESH
  float mixed;  // curvature that no turn of these tangents takes away: of the product of the ways along both
#endif
};

// Twice how much the surface falls under its tangent plane, a way `along` both tangents from a place.
#ifdef ON_MESH
#define FALL_ALONG(place, along) (dot(place.curvature, along * along) + place.mixed * along.x * along.y)
#else
#define FALL_ALONG(place, along) dot(place.curvature, along* along)
#define exact_place(point) place_of(point)
#endif

// The surface touches z = 0 from below in the middle of the unit square.
vec3 on_surface(vec3 world) { return world - vec3(0.5, 0.5, 0.0); }
float surface_relief() { return frame.position.w / frame.right.w; }

#include "surface.glsl"

ivec2 map_size() { return frame.sizes.zw; }
float polygon_t() { return 0.0; }

// Where this pixel's ray enters: in lengths of eye_direction(), and what stands there.
float entered_way;
Place entered;

// The ray that enters at a place. direction: of any length
bool ray_at(Place place, vec3 direction, out Ray ray) {
  precise float fall = -dot(direction, place.normal);
  if (!(fall > 0.0)) return false;
  precise vec2 uv = place.uv * frame.right.w;
  ray.uv = WRAP == WRAP_REPEAT ? uv - floor(uv) : uv;
  precise vec2 along = vec2(dot(direction, place.tangent_u), dot(direction, place.tangent_v)) / fall;
  precise vec2 slope = along / place.scale * frame.position.w;
  ray.slope = slope;
  ray.cosine = fall * inversesqrt(dot(direction, direction));
  ray.level = 0;
  ray.relief = 1.0;
#ifdef BENT_RAYS
  bend_ray(0.5 * surface_relief() * FALL_ALONG(place, along), ray);
  ray.quadric = 0.5 * surface_relief() * FALL_ALONG(place, along) / max(dot(along, along), 1e-12);
#endif
  return true;
}

// False for the sky and, with clamp, beyond the edge of the unit square.
bool make_ray(vec2 pixel, out Ray ray) {
  precise vec3 direction = eye_direction(pixel);
  precise vec3 from = on_surface(frame.position.xyz);
  if (!enter(from, direction, entered_way)) return false;
  precise vec3 point = from + direction * entered_way;
  entered = place_of(point);
  if (WRAP == WRAP_CLAMP && (any(lessThan(entered.uv, vec2(0.0))) || any(greaterThan(entered.uv, vec2(1.0)))))
    return false;
  return ray_at(entered, direction, ray);
}

// What the ray's end makes of its hit: STATUS_PASSED where nothing of the relief is seen.
void end_on_surface(inout Ray ray, inout Hit hit) {
#ifdef BENT_RAYS
  if (leaves(ray) && hit.t >= ray.end) hit.status = STATUS_PASSED;
  unbend(ray, hit);
#endif
#ifdef CLIPPED
  vec2 uv = ray.uv + ray.slope * hit.t;
  if (WRAP == WRAP_CLAMP && (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(frame.right.w)))))
    hit.status = STATUS_PASSED;
#endif
}

#define WAY_PER_T (surface_relief() / -dot(eye_direction(PIXEL), entered.normal))

// What features go by: the plane that touches where the ray enters is theirs, too, and ways to the light are straight
// in it.
vec3 light_here() {
  return vec3(vec2(dot(frame.light.xyz, entered.tangent_u), dot(frame.light.xyz, entered.tangent_v)) / entered.scale,
              dot(frame.light.xyz, entered.normal));
}
vec2 eye_depth_here() { return vec2(entered_way, WAY_PER_T); }

// What is shown of a hit: its uv in tiles, on the place where its ray enters, as relief mapping has it. Of an exact one
// the place itself.
#define SHOWN_DEPTH (1.0 - place.height)
Place shown_place(Ray ray, Hit hit) {
#ifdef HAS_EXACT_HITS
  float way = entered_way + hit.t * WAY_PER_T;
  Place place = exact_place(on_surface(frame.position.xyz) + eye_direction(PIXEL) * way);
  place.uv *= frame.right.w;
#else
  Place place = entered;
  place.uv = ray.uv + ray.slope * hit.t;
  place.height = RAY_HEIGHT(ray, hit.t);
#endif
  return place;
}

// A normal as the normal map has it, in the world.
vec3 surface_normal(vec3 normal, Place place) {
  normal.xy /= place.scale;
  return normalize(place.tangent_u * normal.x + place.tangent_v * normal.y + place.normal * normal.z);
}

// The image of a pixel that has a ray on the plane that touches where it enters.
Pixel pixel_at(vec2 pixel) {
  vec3 direction = eye_direction(pixel);
  vec3 per_fall = direction / dot(direction, entered.normal);
  vec3 right = (frame.right.xyz - per_fall * dot(frame.right.xyz, entered.normal)) / float(frame.sizes.x);
  vec3 up = (frame.up.xyz - per_fall * dot(frame.up.xyz, entered.normal)) / float(frame.sizes.y);
  vec2 texels = 2.0 * entered_way * frame.right.w * vec2(map_size()) / entered.scale;
  float across = length(vec2(dot(right, entered.tangent_u), dot(right, entered.tangent_v)) * texels);
  float down = length(vec2(dot(up, entered.tangent_u), dot(up, entered.tangent_v)) * texels);
  return Pixel(vec2(min(across, down), max(across, down)), entered_way * length(direction) * frame.right.w);
}
