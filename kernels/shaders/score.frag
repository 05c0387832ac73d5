#version 450
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "parameters.glsl"
#include "technique.glsl"
#include "features.glsl"
#include "feature_outputs.glsl"

// The score frame: the ray that was traced, the hit that it found (ScorePixel in score.h), and what features of the
// scene made of it.
layout(location = 0) out vec4 out_ray;
layout(location = 1) out vec4 out_hit;

void main() {
  Ray ray;
  if (!make_ray(gl_FragCoord.xy, ray)) {
    out_ray = vec4(0.0);
    out_hit = vec4(0.0);
#ifdef HAS_FEATURES
    put_nothing();
#endif
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
#ifdef HAS_FEATURES
  put(values_of(ray, hit));
#endif
  out_ray = vec4(ray.uv, ray.slope);
  out_hit = vec4(hit.t, float(hit.status), float(hit.taps), float(hit.steps));
}
