#ifndef CELL_LAYER_GLSL
#define CELL_LAYER_GLSL
// The cones of cells, for rays that go one way.

struct CellLayer {
  vec2 corner;  // its first texel: each of four layers lies within a border (SectorAtlas)
  vec2 size;
  vec2 per_size;  // 1 / size
};

CellLayer cell_layer(vec2 slope) {
  vec2 size = vec2(map_size());
  return CellLayer(vec2(lessThan(slope, vec2(0.0))) * (size + 2.0) + 1.0, size, 1.0 / size);
}

// A cell's highest corner, and the ratio of the cone that stands on it. Beyond a clamped map the nearest cell stands
// for those outside. Elsewhere the half keeps the quotient off whole numbers, as in wrapped().
vec2 cone_of_cell(CellLayer layer, vec2 index) {
  float last = WRAP == WRAP_CLAMP ? 2.0 : 1.0;
  if (WRAP == WRAP_REPEAT) index -= layer.size * floor((index + 0.5) * layer.per_size);
  vec2 texel = layer.corner + clamp(index, vec2(0.0), layer.size - last);
  vec2 cone = texelFetch(extra_map, ivec2(texel), 0).xy;
  return vec2(cone.x, decoded_ratio(cone.y, cone.x));
}
#endif
