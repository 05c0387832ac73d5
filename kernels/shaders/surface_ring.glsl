// A tube round a ring, whose axis is parallel to y: of a sphere the ring has no radius.
// u goes round the ring, v round the tube
Place place_of(vec3 point) {
  precise float z = point.z + frame.surface.x + frame.surface.y;
  precise float axial = max(length(vec2(point.x, z)), 1e-20);
  precise vec2 turn = vec2(point.x, z) / axial;
  precise float across = axial - frame.surface.x;
  precise float radius = max(length(vec2(across, point.y)), 1e-20);
  precise vec2 rise = vec2(across, point.y) / radius;
  precise float outer = frame.surface.x + frame.surface.y;
  precise float angle = atan(point.x, z);
  precise float rise_angle = atan(point.y, across);
  Place place;
  place.normal = vec3(rise.x * turn.x, rise.y, rise.x * turn.y);
  place.tangent_u = vec3(turn.y, 0.0, -turn.x);
  place.tangent_v = vec3(-rise.y * turn.x, rise.x, -rise.y * turn.y);
  place.uv = vec2(0.5 + outer * angle, 0.5 + frame.surface.y * rise_angle);
  place.scale = vec2(max((frame.surface.x + radius * rise.x) / outer, LEAST_SCALE), radius / frame.surface.y);
  place.curvature = vec2(rise.x / max(frame.surface.x + frame.surface.y * rise.x, LEAST_SCALE * outer),
                         1.0 / frame.surface.y);
  place.height = 1.0 - (frame.surface.y - radius) / surface_relief();
  return place;
}
