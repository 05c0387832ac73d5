#ifndef CELL_GLSL
#define CELL_GLSL
// Cells of the bilinear surface along a ray, in the texels of the ray's level.

const float INFINITE_T = 1e30;

// A cell, and the t at which a ray leaves it.
struct Cell {
  vec2 index;  // of its lower texel
  float t_border;
};

// A straight line in texels, x(t) = o + d t, with what is the same at every step.
struct Path {
  vec2 o;
  vec2 d;
  vec2 way;    // the sign of d; 1 where d is 0
  vec2 per_d;  // 1 / d; along a slower axis than 1e-30 it never comes to a border (no 0/0, no 0 * infinity)
};

Path make_path(vec2 o, vec2 d) {
  vec2 way = mix(vec2(1.0), vec2(-1.0), lessThan(d, vec2(0.0)));
  return Path(o, d, way, way / max(abs(d), 1e-30));
}

// A ray in the texels of its level.
Path texel_path(Ray ray) {
  vec2 size = vec2(level_size(ray.level));
  return make_path(ray.uv * size - 0.5, ray.slope * size);
}

// When the path comes to a cell's borders.
vec2 border_times(Path path, vec2 index) { return (index + max(path.way, 0.0) - path.o) * path.per_d; }

// The cell that the path is about to cross at t. On a border it is the one ahead, so that all its border_times are
// later than t, and stepping makes progress with no epsilon.
vec2 index_ahead(Path path, float t) {
  vec2 index = floor(path.o + path.d * t);
  return index + mix(vec2(0.0), path.way, lessThanEqual(border_times(path, index), vec2(t)));
}

Cell cell_ahead(Path path, float t) {
  vec2 index = index_ahead(path, t);
  vec2 borders = border_times(path, index);
  return Cell(index, min(borders.x, borders.y));
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
  float a = -twist * d.x * d.y IF_BENT(+ray.bend);
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
