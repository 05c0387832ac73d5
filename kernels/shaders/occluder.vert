#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"
#include "frame_block.glsl"

// A rectangle right before the eye, over the left frame.forward.w of the frame.
void main() {
  int corner = VERTEX_INDEX < 3 ? VERTEX_INDEX : 6 - VERTEX_INDEX;  // 0 1 2, 3 2 1
  vec2 share = vec2(float(corner & 1), float(corner >> 1));
  gl_Position = vec4(share.x * frame.forward.w * 2.0 - 1.0, share.y * 2.0 - 1.0, 0.0, 1.0);
}
