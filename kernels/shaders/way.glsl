#ifndef WAY_GLSL
#define WAY_GLSL
// What features of the scene make of a ray before it is traced.
struct Way {
  Ray ray;
  Pixel pixel;
  float relief;  // how much of the relief's depth is left; 0: the plane alone, and nothing is traced
};

// The hit on a relief of that depth, as one of the whole ray: it lies as far along it on the plane, and higher.
Hit traced(Way way) {
  if (way.relief <= 0.0) return Hit(0.0, STATUS_HIT, 0, 0);
  way.ray.slope *= way.relief;
  Hit hit = trace(way.ray);
  hit.t *= way.relief;
  return hit;
}

// What is left between the first half of a range and its end.
float left_of(float value, float end) { return clamp(2.0 - 2.0 * value / end, 0.0, 1.0); }
#endif
