#version 450
#extension GL_GOOGLE_include_directive : require
#define BY_COMPUTE
#include "score.glsl"
