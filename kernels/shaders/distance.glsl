// Sphere tracing through a volume of distances to the relief [DON05], which are lower bounds for whole voxels and so
// are fetched, not filtered. Next to the relief they are 0: there the ray goes on by a voxel, then is refined
// (published), or at least to the border of the bilinear cell, which is solved exactly (cell_quad).
#include "cell.glsl"
#include "refinement.glsl"

// The stored distance at t.
float distance_at(Ray ray, float t, inout Hit hit) {
  hit.taps += 1;
  ivec2 texel = ivec2(floor((ray.uv + ray.slope * t) * vec2(map_size())));
  int slice = min(int(RAY_HEIGHT(ray, t) * float(DISTANCE_SLICES)), DISTANCE_SLICES - 1);
  int columns = textureSize(extra_map, 0).x / map_size().x;
  int row = int((float(slice) + 0.5) / float(columns));  // the half is more than the quotient's rounding
  ivec2 corner = ivec2(slice - row * columns, row) * map_size();
  return texelFetch(extra_map, corner + wrapped(texel, map_size()), 0).x;
}

// speed: of the ray in the distances' metric, per t
Hit trace_cells(Ray ray, float speed) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  Path path = texel_path(ray);
  while (hit.status != STATUS_HIT && hit.steps < SPHERE_STEPS) {
    hit.steps += 1;
    float t_next = hit.t + distance_at(ray, hit.t, hit) / speed;
    Cell cell = cell_ahead(path, hit.t);
    if (t_next < cell.t_border) {
      t_next = min(cell.t_border, RAY_END(ray));
      float t_hit = cell_hit(ray, cell, hit.t, t_next, hit);
      // The bottom plate is under every relief.
      if (t_hit < INFINITE_T || t_next == RAY_END(ray)) hit.status = STATUS_HIT;
      t_next = min(t_hit, t_next);
    }
    hit.t = min(t_next, RAY_END(ray));
  }
  return hit;
}

Hit trace_voxels(Ray ray, float speed) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  vec2 texels = abs(ray.slope) * vec2(map_size());
  float voxel_t = 1.0 / max(max(texels.x, texels.y), float(DISTANCE_SLICES));
  Bracket bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  // One look more than there are steps: a hit exactly at the cap is a hit.
  for (int i = 0; i <= SPHERE_STEPS; ++i) {
    float clear = distance_at(ray, hit.t, hit);
    float gap = 0.0;
    float step_t = clear / speed;
    if (clear == 0.0) {
      gap = gap_at(ray, hit.t, hit);
      if (gap <= ARRIVED) {
        bracket.hi = hit.t;
        bracket.gap_hi = gap;
        hit.status = STATUS_HIT;
        break;
      }
      step_t = voxel_t;
    }
    if (i == SPHERE_STEPS) break;
    hit.steps += 1;
    bracket.lo = hit.t;
    bracket.gap_lo = gap;
    hit.t = min(hit.t + step_t, RAY_END(ray));
  }
  // A stored distance leads to the surface at most: only after a least step is there anything to refine.
  if (hit.status == STATUS_HIT && bracket.gap_hi <= 0.0 && bracket.gap_lo > 0.0) refine(ray, bracket, hit);
  return hit;
}

Hit trace(Ray ray) {
  float speed = length(vec3(TILE_SIDE * ray.slope, 1.0));
  if (STEP == STEP_CELL_QUAD) return trace_cells(ray, speed);
  return trace_voxels(ray, speed);
}
