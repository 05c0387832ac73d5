#ifndef SHADER_GLSL
#define SHADER_GLSL
#include "ray.glsl"

const int LOOP_STEPS = 0;
const int LOOP_EARLY_EXIT = 1;
layout(constant_id = 0) const int LOOP = LOOP_STEPS;

// What is read.
layout(binding = 1) uniform sampler2D height_map;

#ifdef BENT_RAYS
#define LEAST 2.0
#else
#define LEAST 1.0
#endif

float height_at(vec2 uv) { return texture(height_map, uv).r; }

struct Hit {
  vec2 uv;
  float t;
};

float unused(float t) {
  return t;
}

Hit first_hit(Ray ray) {
  float t = LOOP == LOOP_STEPS ? 0.0 : LEAST;  // where it begins
  if (LOOP == LOOP_EARLY_EXIT && t > 0.0) {
    t = height_at(vec2(t));
  } else {
    if (LOOP != LOOP_STEPS) return Hit(vec2(0.0), t);

    t += 1.0;
  }
  return Hit(vec2(t), t);
}

#endif
