#include "platform.glsl"
#include "contract.glsl"
#include "ray.glsl"

// What every technique's trace shares. Domain: uv in tiles, height in [0,1] with 1 on top. contract.glsl is generated
// (kernels/trace/shader_contract.cpp): samplers, shared constants and what they may be.

// A ray is above the surface by this much height or less: it has arrived. 2^-14 moves a hit by 0.016 texel of a 256
// map for each unit of slope.
const float ARRIVED = 6.103515625e-5;

// The ray in texture space: p(t) = (uv + slope t, 1 - t), t in [0, 1]; of a bent one see surface_bent.glsl.
struct Ray {
  vec2 uv;
  vec2 slope;    // uv per unit of height
  float cosine;  // of the angle between the view and the plane's normal, > 0
  int level;     // of the map's mip chain that is read
  float relief;  // how much of the relief's depth is left; 0: the polygon alone, and nothing is traced
  IF_BENT(float fall; float bend; float end; float quadric;)
};

// A pixel's image on the plane.
struct Pixel {
  vec2 sides;      // lengths in texels, the shorter one first
  float distance;  // from the eye, in sides of a tile
};

struct Hit {
  float t;
  int status;
  int taps;   // texture instructions
  int steps;  // iterations of all loops
};

#ifdef BENT_RAYS
#include "surface_bent.glsl"
#endif

vec2 within_tile(vec2 x, vec2 size) { return x - size * floor(x * (1.0 / size)); }

// The half keeps the quotient off whole numbers: a reciprocal that is 2.5 ulps off, Vulkan's worst, ends in another
// tile only from |i| = 2^20 on.
ivec2 wrapped(ivec2 i, ivec2 n) {
  return clamp(WRAP == WRAP_CLAMP ? i : ivec2(within_tile(vec2(i) + 0.5, vec2(n))), ivec2(0), n - 1);
}

// tan(y) for y in [0, pi/4] within 2.2e-4; the map was encoded by this very formula.
float tangent(float y) { return y * (15.0 - y * y) / (14.996815 - 5.998726 * y * y); }

const float HALF_PI = 1.57079632679;

// A stored ratio as the tangent it stands for.
float decoded_ratio(float stored, float height) {
  if (ENCODING == ENCODING_SQRT) return stored * stored;
  if (ENCODING == ENCODING_H_TAN) return stored / max(1.0 - height, LEAST_DEPTH);
  if (ENCODING == ENCODING_ATAN)
    return stored < 0.5 ? 1.0 / max(tangent(stored * HALF_PI), 1.0 / UNBOUNDED_RATIO)
                        : tangent((1.0 - stored) * HALF_PI);
  return stored;
}

ivec2 map_size();  // texels

// Size of a level of the map: halves are rounded down.
ivec2 level_size(int level) { return max(map_size() >> level, ivec2(1)); }

vec4 fetch(sampler2D map, ivec2 texel, int level) { return texelFetch(map, wrapped(texel, level_size(level)), level); }

// The four texels round a point, in the order of textureGather, and the point's place between them.
struct Corners {
  vec4 t01, t11, t10, t00;
  vec2 f;
};

Corners fetch_corners(sampler2D map, vec2 uv, int level, inout int taps) {
  taps += 4;
  ivec2 size = level_size(level);
  vec2 x = uv * vec2(size) - 0.5;
  vec2 cell = floor(x);
  ivec2 low = wrapped(ivec2(cell), size);
  ivec2 high = wrapped(ivec2(cell) + 1, size);
  return Corners(texelFetch(map, ivec2(low.x, high.y), level), texelFetch(map, high, level),
                 texelFetch(map, ivec2(high.x, low.y), level), texelFetch(map, low, level), x - cell);
}

vec4 bilinear(Corners c) { return mix(mix(c.t00, c.t10, c.f.x), mix(c.t01, c.t11, c.f.x), c.f.y); }

// What a sampler reads whose weights have SIMULATED_BITS bits.
vec4 simulated_sample(sampler2D map, vec2 uv, int level) {
  int taps = 0;
  Corners c = fetch_corners(map, uv, level, taps);
  float steps = exp2(float(SIMULATED_BITS));
  c.f = floor(c.f * steps + (SIMULATED_WEIGHTS == SIMULATED_WEIGHTS_ROUNDED ? 0.5 : 0.0)) / steps;
  return bilinear(c);
}

// A texture of the map's size at uv, bilinear; the manual filter has full-precision weights, unlike the 8 bits of most
// samplers.
vec4 sample_map(sampler2D map, vec2 uv, int level, inout int taps) {
  if (FILTER == FILTER_MANUAL) return bilinear(fetch_corners(map, uv, level, taps));
  taps += 1;
  if (SIMULATED_BITS != SIMULATED_BITS_NONE) return simulated_sample(map, uv, level);
  return textureLod(map, uv, float(level));
}
