#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"

// One triangle that covers the frame; no vertex buffer.
void main() {
  vec2 corner = vec2((VERTEX_INDEX << 1) & 2, VERTEX_INDEX & 2);
  gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
