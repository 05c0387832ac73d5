#ifndef SHADOW_BLOCK_GLSL
#define SHADOW_BLOCK_GLSL
// What one cell of the bilinear surface keeps of the light.
#include "cell.glsl"
#include "shadow.glsl"

// Whether the cell's surface stands over the ray anywhere from s to s_end. f(s) = f0 + b s + a s^2 is the gap; the ray
// comes in on or above the surface, so that a negative f0 is rounding.
bool cell_blocks(LightRay light, Cell cell, float s, float s_end, inout Hit hit) {
  vec4 h = cell_heights(cell.index, light.path.level, hit.taps);
  vec2 size = vec2(level_size(light.path.level));
  vec2 d = light.path.slope * size;
  vec2 f = light.path.uv * size - 0.5 + d * s - cell.index;
  float along_x = h.z - h.w;
  float along_y = h.x - h.w;
  float twist = h.w - h.z - h.x + h.y;
  float f0 = max((light.z + s) - (h.w + along_x * f.x + (along_y + twist * f.x) * f.y), 0.0);
  float a = -twist * d.x * d.y;
  float b = 1.0 - ((along_x + twist * f.y) * d.x + (along_y + twist * f.x) * d.y);
  float rise = s_end - s;
  if (f0 + (b + a * rise) * rise < 0.0) return true;
  return a > 0.0 && b < 0.0 && -b < 2.0 * a * rise && b * b > 4.0 * a * f0;
}
#endif
