#ifndef FRAME_BLOCK_GLSL
#define FRAME_BLOCK_GLSL
#include "pixel.glsl"
// The C++ twin of the block: FrameUniforms (view.h).

// clang-format off
layout(BINDING(0), std140) uniform Frame {
  vec4 position;  // camera, xyz over the top plate; w = relief depth in sides of one tile
  vec4 right;     // xyz scaled by aspect * tan(fov/2); w = tiling
  vec4 up;        // xyz scaled by tan(fov/2); w = near plane, along the axis in sides of the unit square
  vec4 forward;   // xyz, unit; w = what a draw is told beside (FrameUniforms::argument)
  vec4 light;     // xyz, unit, towards the light; w = tangent of its angular radius
  ivec4 sizes;    // frame width, height in pixels; map width, height in texels
  vec4 surface;   // radius of a torus' ring, or 0; radius; how far the top plate is over the polygon; in sides of the
                  // unit square
} frame;
// clang-format on

#ifdef BY_COMPUTE
bool is_beyond_frame() { return any(greaterThanEqual(ivec2(gl_GlobalInvocationID.xy), frame.sizes.xy)); }
#endif

#define dither_phase relief_dither(ivec2(PIXEL), int(frame.forward.w))

// Of a pixel's ray, of length 1 along the view's axis. `precise`: the same bits in every shader.
vec3 eye_direction(vec2 pixel) {
  precise vec2 ndc = pixel / vec2(frame.sizes.xy) * 2.0 - 1.0;
  precise vec3 direction = frame.forward.xyz + frame.right.xyz * ndc.x - frame.up.xyz * ndc.y;
  return direction;
}
#endif
