#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"
#include "contract.glsl"

layout(location = 0) out vec4 out_color;

void main() { out_color = vec4(0.20, 0.20, 0.22, SEEN_OCCLUDER); }
