// The relief's depth shrinks from half of FADE_TEXELS on, in texels that the pixel covers.
#include "way.glsl"

void begin_fade(inout Way way) { way.ray.relief *= left_of(way.pixel.sides.y, float(FADE_TEXELS)); }
