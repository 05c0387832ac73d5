// Upwards from cell to cell: over a cell's highest corner a ray is lit, if it is steeper than the cone there, or free
// as far as that reaches; the part of it that is under the corner has the cell solved. The cone is right for rays that
// rise, too: from wherever over the cell, none of the surface is in it.
#include "cell_layer.glsl"
#include "shadow_bias.glsl"
#include "shadow_block.glsl"

// A ray that its steps leave undecided is in shadow, so that none is lit that should not be.
float relief_shadow(Ray ray, Scene scene, inout Hit hit) {
  if (is_under_horizon(scene, hit)) return 0.0;
  LightRay light = light_ray(ray, hit, scene, shadow_bias());
  float ray_ratio = length(light.path.slope);
  if (ray_ratio == 0.0) return 1.0;  // straight up
  CellLayer layer = cell_layer(light.path.slope);
  Path path = texel_path(light.path);
  float s = 0.0;
  for (int i = 0; i < SHADOW_STEPS; ++i) {
    hit.steps += 1;
    hit.taps += 1;
    Cell cell = cell_ahead(path, s);
    vec2 cone = cone_of_cell(layer, cell.index);
    float over = light.z + s - cone.x;
    float next = s;
    if (over >= 0.0) {
      if (cone.y >= ray_ratio) return 1.0;
      next += cone.y * over / (ray_ratio - cone.y);
    }
    if (next < cell.t_border) {
      next = min(cell.t_border, light.top);
      if (over < 0.0 && cell_blocks(light, cell, s, next, hit)) return 0.0;
    }
    if (next >= light.top) return 1.0;
    s = next;
  }
  return 0.0;
}
