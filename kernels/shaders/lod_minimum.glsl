// The level by the shorter side of the pixel's image on the plane, constant along the ray.
#include "level.glsl"
#include "way.glsl"

void begin_lod(inout Way way) { way.ray.level = level_of(way.pixel.sides.x); }
