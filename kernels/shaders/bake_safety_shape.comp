#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_shape.glsl"

// A texel's cone and radius, side by side. Where texels are interpolated, the radius is less a texel's diagonal.

layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Ratios { float ratios[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Radii { float radii[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) writeonly buffer Both { vec2 both[]; };

void main() {
  ivec2 texel = own_texel();
  if (is_outside(texel)) return;
  int index = index_of(texel);
  float radius = radii[index];
  if (bake.is_interpolated && radius != CUT_SHORT) radius = rounded_down(max(0.0lf, double(radius) - bake.diagonal));
  both[index] = vec2(ratios[index], radius);
}
