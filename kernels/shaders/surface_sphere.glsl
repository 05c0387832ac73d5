// Longitude along u, latitude along v, with poles in the direction of y. At the poles a side along u has no length.
#include "surface_ring.glsl"
#include "surface_round.glsl"

bool enter(vec3 from, vec3 direction, out float way) {
  float nearest;
  float half_way;
  bool meets = meet_round(from + vec3(0.0, 0.0, frame.surface.y), direction, frame.surface.y, nearest, half_way);
  precise float first = nearest - half_way;
  way = first;
  return meets && way >= 0.0;
}
