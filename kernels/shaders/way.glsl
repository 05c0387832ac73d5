#ifndef WAY_GLSL
#define WAY_GLSL
// What features of the scene make of a ray before it is traced.
struct Way {
  Ray ray;
  Pixel pixel;
};

// The hit on a relief that has shrunk towards the polygon, as one of the whole ray: it lies as far along it on the
// plane, and nearer to the polygon.
Hit traced(Ray ray) {
  if (ray.relief <= 0.0) return Hit(polygon_t(), STATUS_HIT, 0, 0);
  float top = polygon_t() * (1.0 - ray.relief);
  ray.uv += ray.slope * top;
  ray.slope *= ray.relief;
  Hit hit = trace(ray);
  hit.t = top + hit.t * ray.relief;
  return hit;
}

// What is left between the first half of a range and its end.
float left_of(float value, float end) { return clamp(2.0 - 2.0 * value / end, 0.0, 1.0); }
#endif
