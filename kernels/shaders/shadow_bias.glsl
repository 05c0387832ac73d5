#ifndef SHADOW_BIAS_GLSL
#define SHADOW_BIAS_GLSL
// Of the relief's height: 0, 1/1024, 1/256 or 1/64.
float shadow_bias() { return SHADOW_BIAS == SHADOW_BIAS_NONE ? 0.0 : exp2(float(2 * SHADOW_BIAS - 12)); }
#endif
