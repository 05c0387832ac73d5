#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_cone.glsl"
#include "bake_search.glsl"

// The relaxed cone map of [PO07], to the bit as kernels/maps/bake_relaxed_po07.cpp has it: the ray from the top plate
// over the owner, through the target, goes on below it until it leaves the relief. Rays are walked in float, whose
// error is bounded; double precision decides where that is not enough, and makes the keys of those that lower the least
// one.

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

// A ray below its target. Steps count from the target, down to the bottom plate at search_steps.
struct Ray {
  ivec2 offset;  // texels from the owner to the target; under repeat to the nearest image, in (-side/2, side/2]
  float distance2;
  float top;     // the target's height
  float travel;  // what the way from the owner grows by, as a share of that to the target, while z falls by 1
};

// What is exact at a step.
struct ExactPoint {
  double z;
  double scale;
};

ExactPoint exact_point(Ray ray, int at) {
  double top = double(ray.top);
  precise double z = top * (1.0lf - divide(double(at), double(bake.search_steps)));
  precise double scale = 1.0lf + (top - z) * divide(1.0lf, 1.0lf - top);
  return ExactPoint(z, scale);
}

bool exact_has_left(Ray ray, int at) {
  ExactPoint point = exact_point(ray, at);
  precise double x = double(owner.x) + double(ray.offset.x) * point.scale;
  precise double y = double(owner.y) + double(ray.offset.y) * point.scale;
  return exact_surface(x, y) < point.z;
}

// The cone's key where its ray leaves the relief at this step; 0: at the target.
void lower_least(Ray ray, int at) {
  ExactPoint point = ExactPoint(double(ray.top), 1.0lf);
  if (at > 0) point = exact_point(ray, at);
  precise double rise = point.z - double(owner_height);
  if (rise <= 0.0lf) return;
  dvec2 offset = dvec2(ray.offset);
  precise double distance2 = offset.x * offset.x * bake.weight_x + offset.y * offset.y * bake.weight_y;
  precise double scaled2 = distance2 * (point.scale * point.scale);
  precise double rise2 = rise * rise;
  double key = divide(scaled2, rise2);
  if (key < least_key) set_least(key);
}

float sum_of(vec2 v) { return abs(v.x) + abs(v.y); }

// Goes a step down the ray. returns: whether that was its last, since it has left the relief or lowers no key any more
bool is_last_step(Ray ray, int at) {
  const float Z_ERROR = 5e-7;        // of heights along the ray
  const float OFFSET_ERROR = 4e-7;   // a share of the way from the owner
  const float PLACE_ERROR = 2.5e-7;  // and of the coordinate
  float fallen = ray.top * (float(at) * bake.step_share);
  float z = ray.top - fallen;
  float rise = z - owner_height + Z_ERROR;
  float scale = 1.0 + fallen * ray.travel;
  // Farther on the ray is lower and farther away, so that the key only grows.
  if (rise <= 0.0 || ray.distance2 * (scale * scale) >= limit * (rise * rise)) return true;
  vec2 way = vec2(ray.offset) * scale;
  vec2 place = vec2(owner) + way;
  // A surface between heights of 0 and 1 is no steeper than 1 a texel along an axis.
  float error = 2.0 * Z_ERROR + OFFSET_ERROR * sum_of(way) + PLACE_ERROR * sum_of(place);
  float above = z - surface(place);
  bool has_left = at == bake.search_steps || above > error || (above >= -error && exact_has_left(ray, at));
  if (has_left) lower_least(ray, at);
  return has_left;
}

int offset_between(int from, int to, int side) {
  int d = to - from;
  if (bake.repeats && 2 * d > side) d -= side;
  if (bake.repeats && 2 * d <= -side) d += side;
  return d;
}

void try_texel(ivec2 texel, vec2 texels, float top) {
  float rise = top - owner_height;
  Ray ray;
  ray.distance2 = bake.aspect * texels.x * texels.x + texels.y * texels.y;
  if (rise <= 0.0 || ray.distance2 >= limit * rise * rise) return;
  ray.offset = ivec2(offset_between(owner.x, texel.x, bake.size.x), offset_between(owner.y, texel.y, bake.size.y));
  ray.top = top;
  ray.travel = 1.0 / (1.0 - top);
  // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
  if (top >= 1.0) {
    lower_least(ray, 0);
    return;
  }
  for (int at = 1; !is_last_step(ray, at); ++at) {
  }
}

void finish(ivec2 texel) { store_key(texel, least_key); }

void main() {
  owner = own_texel();
  if (is_outside(owner)) return;
  owner_height = height_at(owner);
  set_least(bake.widest_key);
  search();
}
