// Where a line meets a ball or, without what is along the axis, a cylinder of that radius: no difference of large
// squares.
// from: its start, seen from the middle; half_way: from the line's nearest point to either meeting
bool meet_round(vec3 from, vec3 direction, float radius, out float nearest, out float half_way) {
  precise float a = dot(direction, direction);
  precise float b = dot(direction, from);
  precise float to_nearest = -b / a;
  precise vec3 beside = from + direction * to_nearest;
  precise float inside = radius * radius - dot(beside, beside);
  precise float reach = sqrt(max(inside / a, 0.0));
  nearest = to_nearest;
  half_way = reach;
  return a > 0.0 && inside >= 0.0;
}
