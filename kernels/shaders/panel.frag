#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"

// A glyph, a picture, or a white texel, in the corner's color.
layout(BINDING(0)) uniform sampler2D shown;

layout(location = 0) in vec2 corner_uv;
layout(location = 1) in vec4 corner_color;

layout(location = 0) out vec4 out_color;

void main() { out_color = corner_color * textureLod(shown, corner_uv, 0.0); }
