// The bilinear surface, cell by cell: borders that a ray crosses, and its first hit within a cell.
const float INFINITE_T = 1e30;

// The cell of the bilinear surface that the ray is about to cross at t, and the t at which it leaves it.
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
  vec2 size = vec2(frame.sizes.zw);
  vec2 o = ray.uv * size - 0.5;
  vec2 d = ray.slope * size;
  Cell cell;
  cell.index = floor(o + d * t);
  cell.t_border = min(axis_border(o.x, d.x, t, cell.index.x), axis_border(o.y, d.y, t, cell.index.y));
  return cell;
}

// First hit of the ray on the cell's bilinear surface within [t, t_end], or INFINITE_T.
// F(s) = f0 + b s + a s^2 is the gap along the ray; the root is taken in the form that does not cancel.
float cell_hit(Ray ray, Cell cell, float t, float t_end, inout Hit hit) {
  vec2 size = vec2(frame.sizes.zw);
  vec4 h = textureGather(relief_map, (cell.index + 1.0) / size, 0);  // 01, 11, 10, 00
  hit.taps += 1;
  vec2 d = ray.slope * size;
  vec2 f = ray.uv * size - 0.5 + d * t - cell.index;
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  float f0 = (1.0 - t) - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y);
  if (f0 <= 0.0) return t;
  float a = -twist * d.x * d.y;
  float b = -1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y);
  float length_t = t_end - t;
  float f1 = f0 + (b + a * length_t) * length_t;
  float discriminant = b * b - 4.0 * a * f0;
  bool dips = a > 0.0 && b < 0.0 && -b < 2.0 * a * length_t && discriminant >= 0.0;
  if (f1 > 0.0 && !dips) return INFINITE_T;
  float root = sqrt(max(discriminant, 0.0));
  float s = b <= 0.0 ? 2.0 * f0 / (root - b) : (b + root) / (-2.0 * a);
  return t + clamp(s, 0.0, length_t);
}
