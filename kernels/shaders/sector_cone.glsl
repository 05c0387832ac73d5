// Cone stepping with the conservative cone of the ray's own sector of directions: wider than one for all of them. The
// search is that of relaxed cones; what it reads is another map.
#include "relaxed_cone.glsl"
