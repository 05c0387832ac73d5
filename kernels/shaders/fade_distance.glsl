// The relief's depth shrinks in the second half of FADE_DISTANCE from the eye, in sides of a tile.
#include "way.glsl"

void begin_fade(inout Way way) { way.ray.relief *= left_of(way.pixel.distance, float(FADE_DISTANCE)); }
