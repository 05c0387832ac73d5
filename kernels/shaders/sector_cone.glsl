// Cone stepping with the conservative cone of the ray's own sector of directions: wider than one for all of them. The
// search is that of cones for all directions; what it reads is another map.
#define HAS_OPPOSITE
#include "cone.glsl"
