#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"

// Known work for the timer audit and the control case: a dependent chain of LOAD_STEPS multiply-adds a pixel that no
// compiler can shorten (the logistic map is chaotic, and its result is written).
layout(constant_id = 0) const int LOAD_STEPS = 64;

layout(location = 0) out vec4 out_color;

void main() {
  float x = fract(dot(gl_FragCoord.xy, vec2(0.0137, 0.0071))) * 0.8 + 0.1;
  for (int i = 0; i < LOAD_STEPS; ++i) x = 3.9 * x * (1.0 - x);
  out_color = vec4(x, x, x, 1.0);
}
