// The level by the mean of the sides of the pixel's image on the plane, constant along the ray.
#include "level.glsl"
#include "way.glsl"

void begin_lod(inout Way way) { way.ray.level = level_of(0.5 * (way.pixel.sides.x + way.pixel.sides.y)); }
