#ifndef SOLID_CELL_GLSL
#define SOLID_CELL_GLSL
// Cells of a solid between two bilinear surfaces, solved.
#include "cell.glsl"

// A ray that enters by one surface may be outside of the other one by this much of height: where it enters both at
// once, rounding may see either too late.
const float RIM = 1.1920928955078125e-7;  // 2^-23

// f(s) = c + b s + a s^2.
struct Parabola {
  float c;
  float b;
  float a;
};

float parabola_at(Parabola f, float s) { return f.c + (f.b + f.a * s) * s; }

// How far the ray is over the surface of these corners (01, 11, 10, 00) when it has fallen by s from z at f, d a
// height.
Parabola gap_along(vec4 h, vec2 f, vec2 d, float z) {
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  return Parabola(z - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y),
                  -1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y), -twist * d.x * d.y);
}

// Where f falls to zero from above within [0, end], or INFINITE_T; it does so once at most. The root is taken in the
// form that does not cancel.
float falling_root(Parabola f, float end) {
  float discriminant = f.b * f.b - 4.0 * f.a * f.c;
  bool turns = abs(f.b) < 2.0 * abs(f.a) * end && discriminant >= 0.0;
  bool is_below_then = parabola_at(f, end) <= 0.0;
  bool falls = f.c > 0.0 && (is_below_then || (turns && f.a > 0.0 && f.b < 0.0));
  bool arcs = f.c <= 0.0 && is_below_then && turns && f.a < 0.0 && f.b > 0.0;
  if (!falls && !arcs) return INFINITE_T;
  float root = sqrt(max(discriminant, 0.0));
  float s = f.b <= 0.0 ? 2.0 * f.c / (root - f.b) : (f.b + root) / (-2.0 * f.a);
  return clamp(s, 0.0, end);
}

// First point of the ray in the solid of a cell within [t, t_end], or INFINITE_T.
float solid_cell_hit(Ray ray, Cell cell, float t, float t_end, inout Hit hit) {
  vec2 size = vec2(level_size(0));
  vec2 middle = (cell.index + 1.0) / size;
  vec4 tops = textureGather(relief_map, middle, 0);
  vec4 floors;
  if (LAYOUT == LAYOUT_SPLIT) {
    floors = textureGather(extra_map, middle, 0);
  } else {
    floors = textureGather(relief_map, middle, 1);
  }
  hit.taps += 2;
  if (!any(greaterThan(tops, floors))) return INFINITE_T;
  vec2 d = ray.slope * size;
  vec2 f = ray.uv * size - 0.5 + d * t - cell.index;
  Parabola over = gap_along(tops, f, d, 1.0 - t);
  Parabola under = gap_along(floors, f, d, 1.0 - t);
  under = Parabola(-under.c, -under.b, -under.a);
  if (over.c <= 0.0 && under.c <= 0.0) return t;
  float by_top = falling_root(over, t_end - t);
  float by_floor = falling_root(under, t_end - t);
  float first = INFINITE_T;
  if (by_top < INFINITE_T && parabola_at(under, by_top) <= RIM) first = by_top;
  if (by_floor < first && parabola_at(over, by_floor) <= RIM) first = by_floor;
  return first < INFINITE_T ? t + first : INFINITE_T;
}
#endif
