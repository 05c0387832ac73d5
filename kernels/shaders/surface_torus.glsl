// Round the ring along u, round the tube along v.
#include "surface_ring.glsl"
#include "surface_round.glsl"

float torus_distance(vec3 p) { return length(vec2(length(p.xz) - frame.surface.x, p.y)) - frame.surface.y; }

// By sphere tracing from the ball round it: nowhere is the way to the tube shorter than its distance.
bool enter(vec3 from, vec3 direction, out float way) {
  const int MOST_STEPS = 256;
  const float NEAR = 1e-6;  // of the radius
  precise vec3 seen = from + vec3(0.0, 0.0, frame.surface.x + frame.surface.y);
  precise float outer = frame.surface.x + frame.surface.y;
  float nearest;
  float half_way;
  way = 0.0;
  if (!meet_round(seen, direction, outer, nearest, half_way) || torus_distance(seen) < 0.0) return false;
  precise float speed = length(direction);
  precise float at = max(nearest - half_way, 0.0);
  precise float distance = 0.0;
  for (int i = 0; i < MOST_STEPS; ++i) {
    distance = torus_distance(seen + direction * at);
    if (distance <= NEAR * outer) break;
    at += distance / speed;
    if (at > nearest + half_way) return false;
  }
  way = at;
  return distance <= 64.0 * NEAR * outer;
}
