// Relaxed cone stepping [PO07] with the relaxed cone of the ray's own sector of directions, then refinement.
#include "relaxed_cone.glsl"
