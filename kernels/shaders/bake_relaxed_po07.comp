#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"

// The relaxed cone map of [PO07], to the bit as kernels/bake_relaxed_po07.cpp has it.

// The nodes and the fraction between them along one axis, for a texel coordinate of any size.
struct Between {
  int low;
  int high;
  double fraction;
};

Between between(double coordinate, int side) {
  if (!bake.repeats) coordinate = clamp(coordinate, 0.0lf, double(side - 1));
  double whole = floor(coordinate);
  // Exact but for the quotient, which may be one off.
  precise double low = whole - double(side) * floor(whole / double(side));
  if (low < 0.0lf) low += double(side);
  if (low >= double(side)) low -= double(side);
  int i = int(low);
  int next = i + 1 < side ? i + 1 : (bake.repeats ? 0 : i);
  return Between(i, next, coordinate - whole);
}

double lerp(double a, double b, double fraction) {
  precise double value = a + fraction * (b - a);
  return value;
}

double bilinear(double x, double y) {
  Between column = between(x, bake.size.x);
  Between row = between(y, bake.size.y);
  double top = lerp(height_at(ivec2(column.low, row.low)), height_at(ivec2(column.high, row.low)), column.fraction);
  double bottom =
      lerp(height_at(ivec2(column.low, row.high)), height_at(ivec2(column.high, row.high)), column.fraction);
  return lerp(top, bottom, row.fraction);
}

double pair_key(Pair pair) {
  precise double rise = pair.rise;
  precise double scale = 1.0lf;
  // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
  if (pair.target_height < 1.0lf) {
    double travel = divide(1.0lf, 1.0lf - pair.target_height);
    for (int i = 1;; ++i) {
      precise double z = pair.target_height * (1.0lf - divide(double(i), double(bake.search_steps)));
      rise = z - owner_height;
      if (rise <= 0.0lf) return least_key;
      scale = 1.0lf + (pair.target_height - z) * travel;
      if (is_over_least(pair.distance2 * (scale * scale), rise)) return least_key;
      precise double x = double(owner.x) + pair.offset.x * scale;
      precise double y = double(owner.y) + pair.offset.y * scale;
      if (i == bake.search_steps || bilinear(x, y) < z) break;
    }
  }
  precise double distance2 = pair.distance2 * (scale * scale);
  precise double rise2 = rise * rise;
  return divide(distance2, rise2);
}
