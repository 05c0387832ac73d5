// The normal map at the found uv, on the level of the pixel's image on the plane.
#include "level.glsl"

vec4 normal_texel(vec2 uv, Pixel pixel) { return textureLod(normal_map, uv, float(level_of(pixel.sides.y))); }
