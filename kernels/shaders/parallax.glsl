// Parallax mapping: the ray is followed down to the height found straight below its entry. [KAN01]
// The offset limit shortens the shift by the view's cosine, which keeps grazing views from swimming.

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_HIT, 0, 0);
  float depth = RAY_AT_HEIGHT(ray, sample_map(relief_map, ray.uv, ray.level, hit.taps).x);
  hit.t = VARIANT == VARIANT_OFFSET_LIMITED ? depth * ray.cosine : depth;
  return hit;
}
