#include "frame.glsl"
#include "parameters.glsl"
#include "technique.glsl"
#include "features.glsl"
#include "feature_outputs.glsl"

// The score frame: the ray that was traced, the hit that it found (ScorePixel in score.h), and what features of the
// scene made of it.
PIXEL_OUTPUT(0, rgba32f, vec4, out_ray);
PIXEL_OUTPUT(1, rgba32f, vec4, out_hit);

void main() {
#ifdef BY_COMPUTE
  if (is_beyond_frame()) return;
#endif
  Ray ray;
  if (!make_ray(PIXEL, ray)) {
    PUT(out_ray, vec4(0.0));
    PUT(out_hit, vec4(0.0));
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
  PUT(out_ray, vec4(ray.uv, ray.slope));
  PUT(out_hit, vec4(hit.t, float(hit.status), float(hit.taps), float(hit.steps)));
}
