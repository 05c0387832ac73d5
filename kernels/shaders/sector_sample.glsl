#ifndef SECTOR_SAMPLE_GLSL
#define SECTOR_SAMPLE_GLSL
// What stands for cone_sample.glsl where a map has a cone for each sector of directions: a layer a sector, with height
// and ratio in a texel, the layers beside and below one another in extra_map (SectorAtlas in sector_map.h). Under
// HAS_OPPOSITE the parameter RATIOS_A_TEXEL says whether the opposite sector's ratio is there, too.
#include "read_relief.glsl"

const int SHAPE_CONE = 0;  // what is read has a cone, whatever the sector

// The sector of rays that go this way. The baker's wedges make up for the rounding of the product, all else is exact.
int sector_of(vec2 slope) {
  vec2 steep = abs(slope);
  int sector = (slope.x < 0.0 ? 1 : 0) + (slope.y < 0.0 ? 2 : 0);
  if (SECTORS == SECTORS_4) return sector;
  sector += steep.y > steep.x ? 4 : 0;
  if (SECTORS == SECTORS_8) return sector;
  return sector + (min(steep.x, steep.y) > SECTOR_TANGENT * max(steep.x, steep.y) ? 8 : 0);
}

// A sector's cones are all that a ray that way reads.
int ratio_channel(int shape, vec2 slope) { return sector_of(slope); }

// The texel of the atlas with which a layer begins, inside its border.
ivec2 layer_corner(int layer) {
  int columns = SECTORS == SECTORS_4 ? 2 : 4;
  return ivec2(layer % columns, layer / columns) * (map_size() + 2) + 1;
}

vec4 layer_texel(ivec2 corner, ivec2 texel, ivec2 size) {
  return texelFetch(extra_map, corner + wrapped(texel, size), 0);
}

// With weights of full precision, or of a simulated sampler.
vec4 layer_bilinear(ivec2 corner, vec2 uv) {
  ivec2 size = map_size();
  vec2 x = uv * vec2(size) - 0.5;
  vec2 cell = floor(x);
  vec2 f = x - cell;
  if (FILTER == FILTER_HARDWARE && SIMULATED_BITS != SIMULATED_BITS_NONE) {
    float steps = exp2(float(SIMULATED_BITS));
    f = floor(f * steps + (SIMULATED_WEIGHTS == SIMULATED_WEIGHTS_ROUNDED ? 0.5 : 0.0)) / steps;
  }
  ivec2 i = ivec2(cell);
  vec4 low = mix(layer_texel(corner, i, size), layer_texel(corner, i + ivec2(1, 0), size), f.x);
  vec4 high = mix(layer_texel(corner, i + ivec2(0, 1), size), layer_texel(corner, i + ivec2(1, 1), size), f.x);
  return mix(low, high, f.y);
}

// Height and stored ratio of a layer. The border round it serves the sampler where a point lies between the last texel
// and the first one.
vec4 sample_layer(int layer, vec2 uv, inout int taps) {
  ivec2 corner = layer_corner(layer);
  taps += FILTER == FILTER_MANUAL ? 4 : 1;
  if (FILTER == FILTER_MANUAL || SIMULATED_BITS != SIMULATED_BITS_NONE) return layer_bilinear(corner, uv);
  vec2 place = (WRAP == WRAP_CLAMP ? clamp(uv, 0.0, 1.0) : fract(uv)) * vec2(map_size());
  return textureLod(extra_map, (vec2(corner) + place) / vec2(textureSize(extra_map, 0)), 0.0);
}

// The map under the ray at t. channel: the ray's sector, which a caller need not know
Relief sample_relief(Ray ray, float t, int shape, int channel, inout int taps) {
  vec4 texel = sample_layer(sector_of(ray.slope), ray.uv + ray.slope * t, taps);
  Relief relief = decoded_relief(texel.x, texel.y);
#ifdef HAS_OPPOSITE
  if (RATIOS_A_TEXEL == RATIOS_A_TEXEL_2) relief.behind = decoded_relief(texel.x, texel.z).ratio;
#endif
  return relief;
}

// What may be missing of the height, as the sampler reads beside the ray, by SAMPLER_SHIFT texels along each axis and
// by what the atlas's coordinates are rounded. What it reads stands over that point, q; at a point p ahead of the ray,
// or behind it, the surface is no higher than at the point that lies from q as p lies from the ray, plus its slope, of
// one height a texel at most, along either axis. A wider cone does not help, as in cone_sample.glsl: a ray beside it
// may have left the sector.
float sampler_shift(int level) {
  ivec2 atlas = textureSize(extra_map, 0);
  return 2.0 * (float(SAMPLER_SHIFT) * SAMPLER_UNIT + ATLAS_ROUNDING * float(max(atlas.x, atlas.y)));
}

float sure_gap(float ratio, float gap, float shift) { return max(gap - shift, 0.0); }

// How far (in t) the ray may go from `gap` above the surface. A ray straight down meets its own texel, cone or not.
float free_step(Relief relief, float gap, float ray_ratio, int shape) {
  if (ray_ratio == 0.0) return gap;
  return relief.ratio * gap / (ray_ratio + relief.ratio);
}
#endif
