#ifndef FEATURE_GLSL
#define FEATURE_GLSL
// What features of the scene go by, beside a ray and its hit, and what they may change.

struct Scene {
  // Towards the light's middle in tangent space, in sides of the unit square along the tangents and in as many along
  // the normal; unit on a plane. z <= 0: under the horizon
  vec3 light;
  float light_radius;  // tangent of its angular radius; 0: a point
  float relief_depth;  // in sides of a tile
  vec2 planes;         // near and far, along the view's axis
  vec2 eye_depth;      // of the ray along that axis: where it enters, and what is added as far as the bottom plate
};

// A pixel's shading before it is put together.
struct Shading {
  float direct;  // light that comes straight from the source, times its cosine
};
#endif
