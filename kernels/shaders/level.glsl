#ifndef LEVEL_GLSL
#define LEVEL_GLSL
// The level of the map's chain whose texels are at most so large; the last one is 1 x 1.
int level_of(float texels) {
  int level = int(floor(log2(clamp(texels, 1.0, 65536.0))));
  return min(level, findMSB(max(map_size().x, map_size().y)));
}
#endif
