// A ray that bends away from the plane that touches a curved surface, as the surface does: a parabola of the height,
// p(t) = (uv + slope t, 1 - fall t + bend t^2), t in [0, end]. There it is on the bottom plate, or leaves the top one.
// [RTM] 5.6, equation 5.3. With bend >= 0 fall is 1; a surface that bends towards the ray makes it fall faster than a
// straight one, and t is stretched so that nowhere it falls by more than 1: what is free of a straight ray is free of a
// bent one, too.

bool leaves(Ray ray) { return ray.bend > 0.25; }

float parabola_depth(Ray ray, float t) { return (ray.fall - ray.bend * t) * t; }

#ifdef BENT_EXACTLY
// How far a point of the ray, `depth` under the quadric along the normal, is from it across the ray. [RTM]
// equation 5.2, its b completed by the term of the perpendicular's own rise; by 5.3 where it does not meet the quadric
float quadric_distance(Ray ray, float t, float depth) {
  float sine = sqrt(max(1.0 - ray.cosine * ray.cosine, 0.0));
  float beside = t * ray.fall * sine / ray.cosine;
  float a = ray.quadric * ray.cosine * ray.cosine;
  float b = 2.0 * ray.quadric * beside * ray.cosine + sine;
  float rest = b * b + 4.0 * a * depth;
  if (rest < 0.0 || depth <= 0.0) return depth;
  return 2.0 * depth / max(b + sqrt(rest), 1e-12);
}
#endif

// On a plate exactly at its end.
float bent_height(Ray ray, float t) {
  if (t >= ray.end) return leaves(ray) ? 1.0 : 0.0;
#ifdef BENT_EXACTLY
  return 1.0 - quadric_distance(ray, t, parabola_depth(ray, t));
#else
  return 1.0 - parabola_depth(ray, t);
#endif
}

// The lowest on its way from t to t_end.
float bent_lowest(Ray ray, float t, float t_end) {
  float lowest = min(bent_height(ray, t), bent_height(ray, t_end));
  if (2.0 * ray.bend * t < ray.fall && 2.0 * ray.bend * t_end > ray.fall)
    lowest = 1.0 - 0.25 * ray.fall * ray.fall / ray.bend;
  return lowest;
}

// Where it comes down to a height, a little before; its end if it does not. Where it comes so near to it that rounding
// cannot tell, it does: at its lowest.
float bent_at(Ray ray, float height) {
  const float GUARD = 9.5367431640625e-7;  // 2^-20: of a height, four roundings
  float depth = 1.0 - height;
  float rest = ray.fall * ray.fall - 4.0 * ray.bend * depth;
  if (rest < -GUARD * (4.0 * abs(ray.bend) + ray.fall * ray.fall)) return ray.end;
  return min(2.0 * depth / (ray.fall + sqrt(max(rest, 0.0))) * (1.0 - 4.76837158203125e-7), ray.end);
}

// bend: of t as the straight ray has it
void bend_ray(float bend, inout Ray ray) {
  const float MOST = 1e6;
  bend = clamp(bend, -MOST, MOST);
  float root = sqrt(max(1.0 - 4.0 * bend, 0.0));
  ray.fall = bend < 0.0 ? 1.0 / root : 1.0;
  ray.slope *= ray.fall;
  ray.bend = bend * ray.fall * ray.fall;
  ray.end = leaves(ray) ? 1.0 / bend : 2.0 / (1.0 + root) / ray.fall;
}

// The ray and its hit as the straight one counts t.
void unbend(inout Ray ray, inout Hit hit) {
  hit.t *= ray.fall;
  ray.end *= ray.fall;
  ray.slope /= ray.fall;
  ray.bend /= ray.fall * ray.fall;
  ray.fall = 1.0;
}
