// Maximum mipmaps [TIS08]: down the pyramid of the bilinear cells' maxima to cells that the ray may hit, which are
// solved exactly, and up again where the ray passes over a node. Nothing is stepped over: a node is passed only where
// the ray is above its maximum at the far end, and nodes follow each other without a gap.
#include "pyramid.glsl"

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  vec2 size = vec2(map_size());
  Path path = make_path(ray.uv * size - 0.5, ray.slope * size);
  int top = max(first_level(path), ray.level);
  int level = top;
  while (hit.status != STATUS_HIT && hit.steps < NODE_STEPS) {
    hit.steps += 1;
    Node node = node_ahead(path, hit.t, level, -1);
    float t_exit = min(node.t_exit, RAY_END(ray));
    float t_hit = INFINITE_T;
    if (level > 0) {
      float highest = node_height(node, level, hit);
      if (RAY_LOWEST(ray, hit.t, t_exit) <= highest) {
        hit.t = max(hit.t, RAY_AT_HEIGHT(ray, highest));
        if (level == ray.level) {  // its node is a block
          hit.status = STATUS_HIT;
          break;
        }
        level -= 1;
        continue;
      }
    } else {
      t_hit = cell_hit(ray, Cell(node.cell, node.t_exit), hit.t, t_exit, hit);
    }
    // The bottom plate is under every relief.
    if (t_hit < INFINITE_T || t_exit == RAY_END(ray)) hit.status = STATUS_HIT;
    hit.t = min(t_hit, t_exit);
    if (node.leaves_parent && level < top) level += 1;
  }
  return hit;
}
