#ifndef CELL_GLSL
#define CELL_GLSL
// Cells of the bilinear surface along a ray, in the texels of the ray's level.

const float INFINITE_T = 1e30;

// The cell that the ray is about to cross at t, and the t at which it leaves it.
struct Cell {
  vec2 index;  // of its lower texel
  float t_border;
};

// One axis: x(t) = o + d t. On a border, the cell ahead is taken: t_border > t always, so that stepping makes progress
// with no epsilon. d = 0 never leaves (no 0/0).
float axis_border(float o, float d, float t, inout float index) {
  if (d == 0.0) return INFINITE_T;
  float border = d > 0.0 ? index + 1.0 : index;
  float t_border = (border - o) / d;
  if (t_border <= t) {
    index += sign(d);
    t_border = (border + sign(d) - o) / d;
  }
  return t_border;
}

Cell cell_ahead(Ray ray, float t) {
  vec2 size = vec2(level_size(ray.level));
  vec2 o = ray.uv * size - 0.5;
  vec2 d = ray.slope * size;
  Cell cell;
  cell.index = floor(o + d * t);
  cell.t_border = min(axis_border(o.x, d.x, t, cell.index.x), axis_border(o.y, d.y, t, cell.index.y));
  return cell;
}

// Heights of a cell's texels: 01, 11, 10, 00. Gathering is for the base level only.
vec4 cell_heights(vec2 index, int level, inout int taps) {
  if (level == 0) {
    taps += 1;
    return textureGather(relief_map, (index + 1.0) / vec2(level_size(0)), 0);
  }
  taps += 4;
  ivec2 i = ivec2(index);
  return vec4(fetch(relief_map, i + ivec2(0, 1), level).x, fetch(relief_map, i + ivec2(1, 1), level).x,
              fetch(relief_map, i + ivec2(1, 0), level).x, fetch(relief_map, i, level).x);
}

// First hit of the ray on the cell's bilinear surface within [t, t_end], or INFINITE_T.
// F(s) = f0 + b s + a s^2 is the gap along the ray; the root is taken in the form that does not cancel.
float cell_hit(Ray ray, Cell cell, float t, float t_end, inout Hit hit) {
  vec4 h = cell_heights(cell.index, ray.level, hit.taps);
  vec2 size = vec2(level_size(ray.level));
  vec2 d = ray.slope * size;
  vec2 f = ray.uv * size - 0.5 + d * t - cell.index;
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  float f0 = RAY_HEIGHT(ray, t) - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y);
  if (f0 <= 0.0) return t;
  float a = -twist * d.x * d.y IF_BENT(+ ray.bend);
  float b = -1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y);
  IF_BENT(b += 1.0 - ray.fall + 2.0 * ray.bend * t;)
  float length_t = t_end - t;
  float f1 = f0 + (b + a * length_t) * length_t;
  float discriminant = b * b - 4.0 * a * f0;
  bool dips = a > 0.0 && b < 0.0 && -b < 2.0 * a * length_t && discriminant >= 0.0;
  if (f1 > 0.0 && !dips) return INFINITE_T;
  float root = sqrt(max(discriminant, 0.0));
  float s = b <= 0.0 ? 2.0 * f0 / (root - b) : (b + root) / (-2.0 * a);
  return t + clamp(s, 0.0, length_t);
}
#endif
