#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_cone.glsl"
#include "bake_search.glsl"

// The relaxed cone map of [PO07], to the bit as kernels/maps/bake_relaxed_po07.cpp has it: the ray from the top plate
// over the owner, through the target, goes on below it until it leaves the relief. Nearly all pairs are done with in
// float, which bounds their keys from below; what remains is walked again in double.

double least_key;

void set_least(double key) {
  least_key = key;
  limit = float(key / bake.weight_y) * (1.0 + 2.0 * KEY_ERROR);
}

// The nodes round a coordinate along one axis, and how far it is between them.
struct Between {
  int low;
  int high;
  float fraction;
};

Between between(float coordinate, int side) {
  if (bake.repeats) {
    coordinate -= float(side) * floor(coordinate / float(side));
  } else {
    coordinate = clamp(coordinate, 0.0, float(side - 1));
  }
  float whole = floor(coordinate);
  int low = int(whole);
  if (low < 0) low += side;
  if (low >= side) low -= side;
  int high = low + 1 < side ? low + 1 : (bake.repeats ? 0 : low);
  return Between(low, high, coordinate - whole);
}

float surface(vec2 position) {
  Between column = between(position.x, bake.size.x);
  Between row = between(position.y, bake.size.y);
  float top = mix(height_at(ivec2(column.low, row.low)), height_at(ivec2(column.high, row.low)), column.fraction);
  float bottom = mix(height_at(ivec2(column.low, row.high)), height_at(ivec2(column.high, row.high)), column.fraction);
  return mix(top, bottom, row.fraction);
}

float sum_of(vec2 v) { return abs(v.x) + abs(v.y); }

// Whether the pair's key is no better than the least one, whatever float rounds.
bool cannot_improve(vec2 offset, float distance2, float top) {
  const float Z_ERROR = 5e-7;        // of heights along the ray
  const float OFFSET_ERROR = 4e-7;   // a share of the way from the owner
  const float PLACE_ERROR = 2.5e-7;  // and of the coordinate
  if (top >= 1.0) return false;
  float travel = 1.0 / (1.0 - top);
  float step_share = 1.0 / float(bake.search_steps);
  for (int i = 1;; ++i) {
    float fallen = top * (float(i) * step_share);
    float z = top - fallen;
    float rise = z - owner_height + Z_ERROR;
    if (rise <= 0.0) return true;
    float scale = 1.0 + fallen * travel;
    // Farther on the ray is lower and farther away, so that the key only grows.
    if (distance2 * (scale * scale) >= limit * (rise * rise)) return true;
    if (i == bake.search_steps) return false;
    vec2 way = offset * scale;
    vec2 place = vec2(owner) + way;
    // A surface between heights of 0 and 1 is no steeper than 1 a texel along an axis.
    float error = 2.0 * Z_ERROR + OFFSET_ERROR * sum_of(way) + PLACE_ERROR * sum_of(place);
    if (surface(place) < z + error) return false;
  }
}

struct ExactBetween {
  int low;
  int high;
  double fraction;
};

ExactBetween exact_between(double coordinate, int side) {
  if (!bake.repeats) coordinate = clamp(coordinate, 0.0lf, double(side - 1));
  double whole = floor(coordinate);
  // Exact but for the quotient, which may be one off.
  precise double low = whole - double(side) * floor(whole / double(side));
  if (low < 0.0lf) low += double(side);
  if (low >= double(side)) low -= double(side);
  int i = int(low);
  int next = i + 1 < side ? i + 1 : (bake.repeats ? 0 : i);
  return ExactBetween(i, next, coordinate - whole);
}

double lerp(double a, double b, double fraction) {
  precise double value = a + fraction * (b - a);
  return value;
}

double exact_height(int x, int y) { return double(height_at(ivec2(x, y))); }

double exact_surface(double x, double y) {
  ExactBetween column = exact_between(x, bake.size.x);
  ExactBetween row = exact_between(y, bake.size.y);
  double top = lerp(exact_height(column.low, row.low), exact_height(column.high, row.low), column.fraction);
  double bottom = lerp(exact_height(column.low, row.high), exact_height(column.high, row.high), column.fraction);
  return lerp(top, bottom, row.fraction);
}

// Whether a key is so much over the least one that rounding cannot have made it so.
bool is_over_least(double distance2, double rise) {
  const double MARGIN = 1.000000000001lf;
  return distance2 > least_key * (rise * rise) * MARGIN;
}

// The pair's key; any value from least_key on where it is not under it.
double pair_key(dvec2 offset, double target_height) {
  precise double height = double(owner_height);
  precise double rise = target_height - height;
  precise double distance2 = offset.x * offset.x * bake.weight_x + offset.y * offset.y * bake.weight_y;
  precise double scale = 1.0lf;
  // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
  if (target_height < 1.0lf) {
    double travel = divide(1.0lf, 1.0lf - target_height);
    for (int i = 1;; ++i) {
      precise double z = target_height * (1.0lf - divide(double(i), double(bake.search_steps)));
      rise = z - height;
      if (rise <= 0.0lf) return least_key;
      scale = 1.0lf + (target_height - z) * travel;
      if (is_over_least(distance2 * (scale * scale), rise)) return least_key;
      precise double x = double(owner.x) + offset.x * scale;
      precise double y = double(owner.y) + offset.y * scale;
      if (i == bake.search_steps || exact_surface(x, y) < z) break;
    }
  }
  precise double scaled2 = distance2 * (scale * scale);
  precise double rise2 = rise * rise;
  return divide(scaled2, rise2);
}

// The texels from one to another along an axis; under repeat to the nearest image, in (-side/2, side/2].
int offset_between(int from, int to, int side) {
  int d = to - from;
  if (bake.repeats && 2 * d > side) d -= side;
  if (bake.repeats && 2 * d <= -side) d += side;
  return d;
}

void try_texel(ivec2 texel, vec2 texels, float top) {
  float rise = top - owner_height;
  float distance2 = bake.aspect * texels.x * texels.x + texels.y * texels.y;
  if (rise <= 0.0 || distance2 >= limit * rise * rise) return;
  vec2 offset = vec2(offset_between(owner.x, texel.x, bake.size.x), offset_between(owner.y, texel.y, bake.size.y));
  if (cannot_improve(offset, distance2, top)) return;
  double key = pair_key(dvec2(offset), double(top));
  if (key < least_key) set_least(key);
}

void finish(ivec2 texel) { store_key(texel, least_key); }

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  owner_height = height_at(owner);
  set_least(bake.widest_key);
  search();
}
