#include "bake_cone.glsl"

// A packet: 2 x 2 owners, which share a search for their least keys. What vectors of four have of owners is in the
// order (0, 0), (1, 0), (0, 1), (1, 1).

const float ABOVE_ALL = 2.0;

ivec2 owners_x;      // their columns
ivec2 owners_y;      // and rows
vec4 owner_heights;  // ABOVE_ALL: outside of the map
vec4 eyes;           // the same; ABOVE_ALL of owners that take no part in a round
vec4 keys;           // the least so far, in float

// The 2 x 2 texels that were looked at last: where the first one is, as owners see it, and their heights.
ivec2 looked_first;
vec4 looked_tops;

// From owners' columns (axis 0) or rows to boxes whose middles are at the offsets, and that reach `reach` to both
// sides. The including file defines it.
vec2 distances_along(int axis, vec2 offsets, float reach);

ivec2 packet = own_texel();
ivec2 first_texel() { return 2 * packet; }
ivec2 last_texel() { return min(first_texel() + 1, sides - 1); }
// The texel whose ratio is an owner's, and the one that looks for it.
ivec2 texel_of(int owner) { return first_texel() + ivec2(owner & 1, owner >> 1); }
ivec2 owner_at(int owner) {
  return ivec2((owner & 1) == 0 ? owners_x.x : owners_x.y, owner < 2 ? owners_y.x : owners_y.y);
}

// v[i]. Indices that only a device knows would have it keep vectors in memory.
float component(vec4 v, int i) {
  vec2 pair = i < 2 ? v.xy : v.zw;
  return (i & 1) == 0 ? pair.x : pair.y;
}
uint component(uvec4 v, int i) {
  uvec2 pair = i < 2 ? v.xy : v.zw;
  return (i & 1) == 0 ? pair.x : pair.y;
}

bvec4 is_owner(int owner) { return equal(ivec4(owner), ivec4(0, 1, 2, 3)); }

// first, last: corners that are owners
void start(ivec2 first, ivec2 last) {
  owners_x = ivec2(first.x, last.x);
  owners_y = ivec2(first.y, last.y);
  keys = vec4(bake.widest_in_rows);
  for (int k = 0; k < 4; ++k) owner_heights[k] = is_outside(texel_of(k)) ? ABOVE_ALL : height_at(owner_at(k));
  eyes = owner_heights;
}

bvec4 both(bvec4 a, bvec4 b) { return mix(bvec4(false), a, b); }
bvec4 either(bvec4 a, bvec4 b) { return mix(a, bvec4(true), b); }
uint bits_of(bvec4 owners) {
  uvec4 bits = mix(uvec4(0u), uvec4(1u, 2u, 4u, 8u), owners);
  return bits.x | bits.y | bits.z | bits.w;
}

vec4 limits() { return keys * (1.0 + 2.0 * KEY_ERROR); }
vec4 distances2(vec4 x, vec4 y) { return aspect * x * x + y * y; }
