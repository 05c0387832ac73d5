// As max_mip, in a solid: down the pyramid of the cells' highest tops and lowest floors to cells that the ray may meet,
// which are solved exactly, and up again where it leaves a node. A node is passed where the ray is over or under all of
// it, or where it holds nothing.
#define MAY_PASS
#include "pyramid.glsl"
#include "solid_cell.glsl"

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  vec2 size = vec2(map_size());
  Path path = make_path(ray.uv * size - 0.5, ray.slope * size);
  int top = first_level(path);
  int level = top;
  while (hit.status == STATUS_STEP_CAP && hit.steps < NODE_STEPS) {
    hit.steps += 1;
    Node node = node_ahead(path, hit.t, level, -1);
    float t_exit = min(node.t_exit, 1.0);
    if (level > 0) {
      hit.taps += 1;
      vec2 bounds = texelFetch(extra_map, node.index, level).xy;
      if (bounds.x > bounds.y && 1.0 - t_exit <= bounds.x && 1.0 - hit.t >= bounds.y) {
        hit.t = max(hit.t, 1.0 - bounds.x);
        level -= 1;
        continue;
      }
    } else {
      float t_hit = solid_cell_hit(ray, Cell(node.cell, node.t_exit), hit.t, t_exit, hit);
      if (t_hit < INFINITE_T) {
        hit.t = t_hit;
        hit.status = STATUS_HIT;
        break;
      }
    }
    hit.t = t_exit;
    if (t_exit == 1.0) hit.status = STATUS_PASSED;
    if (node.leaves_parent && level < top) level += 1;
  }
  return hit;
}
