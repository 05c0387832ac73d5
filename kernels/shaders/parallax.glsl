// Parallax mapping: the ray is followed to the height found where it meets the polygon. [KAN01]
// The offset limit shortens the shift by the view's cosine, which keeps grazing views from swimming.

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_HIT, 0, 0);
  float polygon = polygon_t();
  float found = RAY_AT_HEIGHT(ray, sample_map(relief_map, ray.uv + ray.slope * polygon, ray.level, hit.taps).x);
  hit.t = VARIANT == VARIANT_OFFSET_LIMITED ? polygon + (found - polygon) * ray.cosine : found;
  return hit;
}
