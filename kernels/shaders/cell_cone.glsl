// Cone step mapping with a cone for each cell of the bilinear surface and each quarter of the directions: it stands on
// the cell's highest corner and is read by one fetch, with nothing interpolated. Where it does not lead out of the cell
// the ray goes to the border if it stays over that corner, or the cell's surface is solved.
#include "cell.glsl"

// The first texel of the layer of rays that go this way: one of four, each within a border (SectorAtlas).
ivec2 layer_corner(vec2 slope) { return ivec2(slope.x < 0.0, slope.y < 0.0) * (map_size() + 2) + 1; }

// Beyond a clamped map the nearest cell stands for those outside.
int cell_texel(float index, int side) {
  return WRAP == WRAP_CLAMP ? int(clamp(index, 0.0, float(side - 2))) : wrapped(int(index), side);
}

// Two loops, one in the other [AL09]: rays that run together solve their cells together, too.
Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  ivec2 corner = layer_corner(ray.slope);
  float ray_ratio = length(ray.slope);
  while (hit.status != STATUS_HIT && hit.steps < CONE_STEPS) {
    Cell cell;
    float t_exit;
    bool may_hit = false;
    while (!may_hit && hit.status != STATUS_HIT && hit.steps < CONE_STEPS) {
      hit.steps += 1;
      cell = cell_ahead(ray, hit.t);
      t_exit = min(cell.t_border, RAY_END(ray));
      ivec2 texel = ivec2(cell_texel(cell.index.x, map_size().x), cell_texel(cell.index.y, map_size().y));
      vec2 cone = texelFetch(extra_map, corner + texel, 0).xy;
      hit.taps += 1;
      float highest = cone.x;
      float ratio = decoded_ratio(cone.y, highest);
      float gap = max(RAY_HEIGHT(ray, hit.t) - highest, 0.0);
      float t_free = min(hit.t + ratio * gap / max(ray_ratio + ratio, 1e-30), RAY_END(ray));
      may_hit = t_free < t_exit && RAY_LOWEST(ray, hit.t, t_exit) <= highest;
      if (!may_hit) hit.t = max(t_free, t_exit);
      // The bottom plate is under every relief.
      if (hit.t == RAY_END(ray)) hit.status = STATUS_HIT;
    }
    if (may_hit) {
      float t_hit = cell_hit(ray, cell, hit.t, t_exit, hit);
      hit.t = min(t_hit, t_exit);
      if (t_hit < INFINITE_T || hit.t == RAY_END(ray)) hit.status = STATUS_HIT;
    }
  }
  return hit;
}
