#ifndef DEPTH_FRAME_GLSL
#define DEPTH_FRAME_GLSL
// How the depth of a hit comes into the frame: frames with it hold objects that cut through the relief.
#include "feature.glsl"

#define HAS_OBJECTS
#ifdef IS_SHADED
#ifdef DEPTH_CONSERVATIVE
// No hit is nearer than the plate (plate.vert), so that fragments may be rejected by the plate's depth before they run.
layout(depth_greater) out float gl_FragDepth;
void shade_depth(float depth, inout Shading shading) { gl_FragDepth = max(depth, gl_FragCoord.z); }
#else
void shade_depth(float depth, inout Shading shading) { gl_FragDepth = depth; }
#endif
#else
void shade_depth(float depth, inout Shading shading) {}
#endif
#endif
