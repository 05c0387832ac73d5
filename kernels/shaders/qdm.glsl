// Quadtree displacement mapping [DRO18]: down the quadtree of the texels' maxima to a texel whose block the ray enters,
// then refined on the bilinear surface. The blocks do not bound that surface between them, so that it may be crossed
// before a block is entered (the bracket then reaches back by one texel), or a ray may pass through a block above it:
// the ray goes on where it is above the surface in the middle and at the end of its way through the block.
#include "pyramid.glsl"
#include "refinement.glsl"

// The surface's crossing near the block of a texel, which the ray enters at t and leaves at t_exit; false: none.
bool surface_hit(Ray ray, Path path, float t, float t_exit, inout Hit hit) {
  Bracket bracket = Bracket(0.0, 0.0, 0.0, 0.0);
  if (is_above(ray, t, bracket, hit)) {
    // Over a texel the surface is a tent: the ray may be above it at both ends of its way, and not in the middle.
    if (is_above(ray, 0.5 * (t + t_exit), bracket, hit) && is_above(ray, t_exit, bracket, hit)) return false;
  } else {
    float texel_t = 1.0 / max(max(abs(path.d.x), abs(path.d.y)), 1.0);
    float before = max(t - texel_t, 0.0);
    if (!is_above(ray, before, bracket, hit)) {
      hit.t = before;
      return true;
    }
  }
  refine(ray, bracket, hit);
  return true;
}

Hit trace(Ray ray) {
  Hit hit = Hit(0.0, STATUS_STEP_CAP, 0, 0);
  vec2 size = vec2(map_size());
  Path path = make_path(ray.uv * size, ray.slope * size);
  int top = max(first_level(path), ray.level);
  int level = top;
  for (int i = 0; i < NODE_STEPS && hit.status != STATUS_HIT; ++i) {
    hit.steps += 1;
    Node node = node_ahead(path, hit.t, level, 0);
    float t_exit = min(node.t_exit, RAY_END(ray));
    float highest = node_height(node, level, hit);
    if (RAY_LOWEST(ray, hit.t, t_exit) <= highest) {
      hit.t = max(hit.t, RAY_AT_HEIGHT(ray, highest));
      if (level > ray.level) {
        level -= 1;
        continue;
      }
      if (REFINEMENT == REFINEMENT_NONE || level > 0 || surface_hit(ray, path, hit.t, t_exit, hit)) {
        hit.status = STATUS_HIT;
        break;
      }
    }
    hit.t = t_exit;
    if (node.leaves_parent && level < top) level += 1;
  }
  return hit;
}
