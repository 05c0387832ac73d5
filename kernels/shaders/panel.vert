#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"

// What Dear ImGui draws: corners of triangles, already in clip space.
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 color;

layout(location = 0) out vec2 corner_uv;
layout(location = 1) out vec4 corner_color;

void main() {
  corner_uv = uv;
  corner_color = color;
  gl_Position = vec4(position, 0.0, 1.0);
}
