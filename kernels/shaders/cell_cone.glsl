// Cone step mapping with a cone for each cell of the bilinear surface and each quarter of the directions: it stands on
// the cell's highest corner and is read by one fetch, with nothing interpolated. Where it does not lead out of the cell
// the ray goes to the border if it stays over that corner, or the cell's surface is solved.
#include "cell.glsl"
#include "cell_layer.glsl"

// Two loops, one in the other [AL09]: rays that run together solve their cells together, too.
Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  float ray_ratio = length(ray.slope);
  CellLayer layer = cell_layer(ray.slope);
  Path path = texel_path(ray);
  bool goes_on = CONE_STEPS > 0;
  while (goes_on) {
    bool may_hit;
    do {
      hit.steps += 1;
      Cell cell = cell_ahead(path, hit.t);
      float t_exit = min(cell.t_border, RAY_END(ray));
      vec2 cone = cone_of_cell(layer, cell.index);
      float gap = max(RAY_HEIGHT(ray, hit.t) - cone.x, 0.0);
      float t_free = min(hit.t + cone.y * gap / max(ray_ratio + cone.y, 1e-30), RAY_END(ray));
      may_hit = t_free < t_exit && RAY_LOWEST(ray, hit.t, t_exit) <= cone.x;
      if (!may_hit) hit.t = max(t_free, t_exit);
      goes_on = hit.t < RAY_END(ray) && hit.steps < CONE_STEPS;
    } while (!may_hit && goes_on);
    if (may_hit) {
      Cell cell = cell_ahead(path, hit.t);
      float t_exit = min(cell.t_border, RAY_END(ray));
      float t_hit = cell_hit(ray, cell, hit.t, t_exit, hit);
      hit.t = min(t_hit, t_exit);
      if (t_hit < INFINITE_T) hit.status = STATUS_HIT;
      goes_on = goes_on && hit.status != STATUS_HIT && hit.t < RAY_END(ray);
    }
  }
  // The bottom plate is under every relief.
  if (hit.t == RAY_END(ray)) hit.status = STATUS_HIT;
  hit.taps += hit.steps;
  return hit;
}
