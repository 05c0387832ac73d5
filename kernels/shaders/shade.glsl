#define IS_SHADED  // not the score frame
#include "frame.glsl"
#include "parameters.glsl"
#include "technique.glsl"
#include "features.glsl"

// The timed frame: the same trace, shaded. One normal fetch and a smooth albedo, so that the trace is what differs.
PIXEL_OUTPUT(0, rgba8, vec4, out_color);

const vec3 SKY = vec3(0.55, 0.65, 0.80);

// [PO07] keeps normals apart from depths; the other layout is there to measure that.
vec3 normal_at(vec2 uv, vec2 pixel) {
  if (LAYOUT == LAYOUT_WITH_NORMAL) {
    vec2 xy = textureLod(relief_map, uv, 0.0).zw * 2.0 - 1.0;
    return vec3(xy, sqrt(max(1.0 - dot(xy, xy), 0.0)));
  }
#ifdef HAS_NORMALS
  vec4 texel = normal_texel(uv, pixel_at(pixel));
#else
  vec4 texel = textureLod(normal_map, uv, 0.0);
#endif
  return normalize(texel.xyz * 2.0 - 1.0);
}

void main() {
#ifdef BY_COMPUTE
  if (is_beyond_frame()) return;
#endif
  Ray ray;
  if (!make_ray(PIXEL, ray)) {
#ifdef HAS_OBJECTS
    discard;  // what stands behind is seen
#endif
    PUT(out_color, vec4(SKY, 1.0));
    return;
  }
#ifdef HAS_WAY
  Hit hit = trace_way(ray);
#else
  Hit hit = trace(ray);
#endif
#ifdef CURVED
  end_on_surface(ray, hit);
#endif
#ifdef MAY_PASS
  if (hit.status == STATUS_PASSED) {
#ifdef HAS_OBJECTS
    discard;
#endif
    PUT(out_color, vec4(SKY, 1.0));
    return;
  }
#endif
#ifdef CURVED
  Place place = shown_place(ray, hit);
  vec2 uv = place.uv;
  vec3 normal = surface_normal(normal_at(uv, PIXEL), place);
#else
  vec2 uv = ray.uv + ray.slope * hit.t;
  vec3 normal = normal_at(uv, PIXEL);
#define SHOWN_DEPTH hit.t
#endif
  // Four waves a tile show where the texture was looked up, and a hit's depth darkens it: less so where the relief is
  // shallower than a tenth of a tile, so that one without depth looks like plain normal mapping.
  vec2 wave = sin(uv * (4.0 * 6.283185307));
  vec3 albedo = vec3(0.62, 0.55, 0.48) + 0.12 * wave.x * wave.y;
  float diffuse = max(dot(normal, frame.light.xyz), 0.0);
#ifdef HAS_FEATURES
  Shading shading = Shading(diffuse);
  shade(values_of(ray, hit), shading);
  diffuse = shading.direct;
#endif
  PUT(out_color,
      vec4(albedo * (0.25 + 0.85 * diffuse) * (1.0 - 0.35 * SHOWN_DEPTH * min(10.0 * frame.position.w, 1.0)), 1.0));
}
