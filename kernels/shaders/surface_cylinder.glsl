// Round along u about an axis parallel to y, endless along v.
#include "surface_round.glsl"

bool enter(vec3 from, vec3 direction, out float way) {
  vec3 flat_from = vec3(from.x, 0.0, from.z + frame.surface.y);
  float nearest;
  float half_way;
  bool meets = meet_round(flat_from, vec3(direction.x, 0.0, direction.z), frame.surface.y, nearest, half_way);
  precise float first = nearest - half_way;
  way = first;
  return meets && way >= 0.0;
}

Place place_of(vec3 point) {
  precise float z = point.z + frame.surface.y;
  precise float radius = max(length(vec2(point.x, z)), 1e-20);
  precise vec2 turn = vec2(point.x, z) / radius;
  precise float angle = atan(point.x, z);
  Place place;
  place.normal = vec3(turn.x, 0.0, turn.y);
  place.tangent_u = vec3(turn.y, 0.0, -turn.x);
  place.tangent_v = vec3(0.0, 1.0, 0.0);
  place.uv = vec2(0.5 + frame.surface.y * angle, 0.5 + point.y);
  place.scale = vec2(radius / frame.surface.y, 1.0);
  place.curvature = vec2(1.0 / frame.surface.y, 0.0);
  place.height = 1.0 - (frame.surface.y - radius) / surface_relief();
  return place;
}
