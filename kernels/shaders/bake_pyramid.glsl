// A max pyramid of 2 x 2 nodes together: a quad of level L holds the four nodes of level L - 1 that one of level L is
// made of, in the order (0, 0), (1, 0), (0, 1), (1, 1). Level 0 is the texels. A node outside the map is NOTHING.

const float NOTHING = -1.0;

// Nodes along the axes at a level.
ivec2 nodes_at(int level) { return ((sides - 1) >> level) + 1; }

int pyramid_quads = bake.pyramid_quads;

int quad_index(int pyramid, int level, ivec2 quad) {
  ivec4 place = bake.levels[level - 1];
  return pyramid * pyramid_quads + place.x + quad.y * place.y + quad.x;
}
