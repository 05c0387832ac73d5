#version 450
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "parameters.glsl"
#include "technique.glsl"

// The score frame: the ray that was traced, and the hit that it found (ScorePixel in score.h).
layout(location = 0) out vec4 out_ray;
layout(location = 1) out vec4 out_hit;

void main() {
  Ray ray;
  if (!make_ray(gl_FragCoord.xy, ray)) {
    out_ray = vec4(0.0);
    out_hit = vec4(0.0);
    return;
  }
  Hit hit = trace(ray);
  out_ray = vec4(ray.uv, ray.slope);
  out_hit = vec4(hit.t, float(hit.status), float(hit.taps), float(hit.steps));
}
