#ifndef CONE_SAMPLE_GLSL
#define CONE_SAMPLE_GLSL
// What a map keeps of the empty space over a point: the ratio that a ray reads, and a radius.
const int SHAPE_CONE = 0;    // one ratio
const int SHAPE_QUAD = 1;    // four, one for each quarter of the directions: +x, -x, +y, -y
const int SHAPE_SAFETY = 2;  // one, and the radius of a cylinder

// Which of the stored ratios is for rays of this slope; that of rays the other way differs in the lowest bit.
int ratio_channel(int shape, vec2 slope) {
  if (shape != SHAPE_QUAD) return 0;
  if (abs(slope.y) <= abs(slope.x)) return slope.x < 0.0 ? 1 : 0;
  return slope.y < 0.0 ? 3 : 2;
}

vec4 decoded_ratios(vec4 stored, vec4 heights) {
  return vec4(decoded_ratio(stored.x, heights.x), decoded_ratio(stored.y, heights.y),
              decoded_ratio(stored.z, heights.z), decoded_ratio(stored.w, heights.w));
}

// Bilinear height, and the narrowest cone of the four texels that it comes from. On a cell's border the sampler's
// rounding may take the height from one cell and the cones from the next one: both hold the texels that have weight
// there, so that either minimum bounds them.
vec2 sample_min4(vec2 uv, int level, inout int taps) {
  float height;
  vec4 heights = vec4(0.0);
  vec4 stored;
  if (FILTER == FILTER_HARDWARE && level == 0) {
    height = sample_map(relief_map, uv, 0, taps).x;
    stored = LAYOUT == LAYOUT_SPLIT ? textureGather(extra_map, uv, 0) : textureGather(relief_map, uv, 1);
    taps += 1;
    if (ENCODING == ENCODING_H_TAN) {  // the only code that means another ratio at another height
      heights = textureGather(relief_map, uv, 0);
      taps += 1;
    }
  } else {  // gathering is for the base level only
    Corners c = fetch_corners(relief_map, uv, level, taps);
    height = FILTER == FILTER_MANUAL ? bilinear(c).x : sample_map(relief_map, uv, level, taps).x;
    heights = vec4(c.t01.x, c.t11.x, c.t10.x, c.t00.x);
    stored = vec4(c.t01.y, c.t11.y, c.t10.y, c.t00.y);
    if (LAYOUT == LAYOUT_SPLIT) {
      c = fetch_corners(extra_map, uv, level, taps);
      stored = vec4(c.t01.x, c.t11.x, c.t10.x, c.t00.x);
    }
  }
  vec4 ratios = decoded_ratios(stored, heights);
  return vec2(height, min(min(ratios.x, ratios.y), min(ratios.z, ratios.w)));
}

#include "read_relief.glsl"

// The map under the ray at t, as a technique with this shape reads it.
Relief sample_relief(Ray ray, float t, int shape, int channel, inout int taps) {
  vec2 uv = ray.uv + ray.slope * t;
  if (CONE_FETCH == CONE_FETCH_MIN4) {
    vec2 cone = sample_min4(uv, ray.level, taps);
    if (SAMPLER_ERROR != SAMPLER_ERROR_NONE) cone.x += sampler_error();  // its ratios are gathered
    return Relief(cone.x, cone.y, 0.0, cone.y);
  }
  vec4 texel = sample_map(relief_map, uv, ray.level, taps);
  vec4 stored = texel.yyyy;
  if (LAYOUT == LAYOUT_SPLIT) stored = sample_map(extra_map, uv, ray.level, taps);
  Relief relief = decoded_relief(texel.x, stored[channel]);
  if (shape == SHAPE_QUAD) relief.behind = decoded_relief(texel.x, stored[channel ^ 1]).ratio;
  if (shape == SHAPE_SAFETY) relief.radius = decoded_ratio(stored.y, texel.x);
  return relief;
}

// How far (in uv) beside the ray the sampler may read the map: SAMPLER_SHIFT texels along each axis.
float sampler_shift(int level) { return float(SAMPLER_SHIFT) * SAMPLER_UNIT * length(1.0 / vec2(level_size(level))); }

// How much of `gap` is sure then: the cone that is shown stands up to `shift` away, and so holds one that stands here,
// with a higher apex.
float sure_gap(float ratio, float gap, float shift) { return ratio > 0.0 ? max(gap - shift / ratio, 0.0) : 0.0; }

// How far (in t) the ray may go from `gap` above the surface. A ray straight down meets its own texel, cone or not.
float free_step(Relief relief, float gap, float ray_ratio, int shape) {
  if (ray_ratio == 0.0) return gap;
  float cone = relief.ratio * gap / (ray_ratio + relief.ratio);
  return shape == SHAPE_SAFETY ? max(cone, relief.radius / ray_ratio) : cone;
}
#endif
