layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Heights { float heights[]; };

double height_at(ivec2 texel) { return double(heights[index_of(wrapped(texel))]); }

// In the order (0, 0), (1, 0), (0, 1), (1, 1).
void corners_of(ivec2 cell, out Corner corners[4]) {
  double h00 = height_at(cell);
  double h10 = height_at(cell + ivec2(1, 0));
  double h01 = height_at(cell + ivec2(0, 1));
  double h11 = height_at(cell + ivec2(1, 1));
  corners[0] = Corner(h00, h10 - h00, h01 - h00);
  corners[1] = Corner(h10, h10 - h00, h11 - h10);
  corners[2] = Corner(h01, h11 - h01, h01 - h00);
  corners[3] = Corner(h11, h11 - h01, h11 - h10);
}
