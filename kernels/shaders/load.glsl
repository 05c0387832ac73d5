#include "platform.glsl"
#include "frame_block.glsl"

// Known work for the timer audit and the control case: a dependent chain of LOAD_STEPS multiply-adds a pixel that no
// compiler can shorten (the logistic map is chaotic, and its result is written).
layout(constant_id = 0) const int LOAD_STEPS = 64;

PIXEL_OUTPUT(0, rgba8, vec4, out_color);

void main() {
#ifdef BY_COMPUTE
  if (is_beyond_frame()) return;
#endif
  float x = fract(dot(PIXEL, vec2(0.0137, 0.0071))) * 0.8 + 0.1;
  for (int i = 0; i < LOAD_STEPS; ++i) x = 3.9 * x * (1.0 - x);
  PUT(out_color, vec4(x, x, x, 1.0));
}
