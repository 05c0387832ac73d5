// Round the ring along u, round the tube along v.
#include "surface_ring.glsl"
#include "surface_round.glsl"

float torus_distance(vec3 p) { return length(vec2(length(p.xz) - frame.surface.x, p.y)) - frame.surface.y; }

// How fast the distance falls on the way.
float torus_fall(vec3 p, vec3 direction) {
  precise float axial = max(length(p.xz), 1e-20);
  precise vec2 across = vec2(axial - frame.surface.x, p.y);
  precise vec2 speed = vec2(dot(p.xz, direction.xz) / axial, direction.y);
  return -dot(across, speed) / max(length(across), 1e-20);
}

// By sphere tracing from the ball round it: nowhere is the way to the tube shorter than its distance. Near it by
// Newton's steps: spheres of a grazing ray come no nearer.
bool enter(vec3 from, vec3 direction, out float way) {
  const int MOST_STEPS = 256;
  const float NEAR = 1e-4;                     // of the radius
  const float ARRIVED = 2.384185791015625e-7;  // of the radius and the way: what floats know of the distance
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
    precise vec3 point = seen + direction * at;
    precise float fall = torus_fall(point, direction);
    distance = torus_distance(point);
    bool is_near = distance <= NEAR * outer;
    if (is_near && fall > 0.0)
      at += distance / fall;
    else
      at += max(distance, NEAR * outer) / speed;
    if (is_near && abs(distance) <= ARRIVED * (outer + speed * at)) break;
    if (at > nearest + half_way) return false;
  }
  way = at;
  return distance <= NEAR * outer;
}
