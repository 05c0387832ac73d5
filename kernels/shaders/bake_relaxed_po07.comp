#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_cone.glsl"

// The relaxed cone map of [PO07], to the bit as kernels/maps/bake_relaxed_po07.cpp has it: the ray from the top plate
// over the owner, through the target, goes on below it until it leaves the relief. Rays are walked in float, whose
// error is bounded; double precision decides where that is not enough, and makes the keys of those that lower the least
// one.
//
// A workgroup makes one texel. Its invocations look for targets together, and each takes the next ray as it is done
// with its last: rays differ so much in length that invocations with a texel each would mostly wait for one another.

const int LANES = GROUP_SIDE * GROUP_SIDE;
const int BLOCK_LEVEL = 3;    // of the pyramid: 8 x 8 texels, one a lane
const int FIELD_LEVEL = 6;    // 8 x 8 blocks
const int QUEUED_BLOCKS = 8;  // whose texels all fit into the queue of targets

shared uint shared_limit;  // as bits, whose order is that of the floats
shared uint fields[LANES];
shared uint blocks[LANES];
shared uint targets[QUEUED_BLOCKS * LANES];
shared uint field_count;
shared uint block_count;
shared uint target_count;
shared uint next_target;
shared double least_keys[LANES];

int lane;
double least_key;  // of this lane's rays

float limit_of(double key) { return float(key / bake.weight_y) * (1.0 + 2.0 * KEY_ERROR); }
void refresh_limit() { limit = uintBitsToFloat(atomicAdd(shared_limit, 0u)); }

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
  if (key >= least_key) return;
  least_key = key;
  limit = min(limit, limit_of(key));
  atomicMin(shared_limit, floatBitsToUint(limit));
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

uint packed(ivec2 place) { return uint(place.x) | (uint(place.y) << 16); }
ivec2 unpacked(uint place) { return ivec2(place & 0xffffu, place >> 16); }
ivec2 place_in_group(int i) { return ivec2(i % GROUP_SIDE, i / GROUP_SIDE); }

float distance2_to(ivec2 first, float size) {
  float reach = 0.5 * (size - 1.0);
  vec2 middle = vec2(first - owner) + reach;
  float x = distance_to(middle.x, reach, float(bake.size.x));
  float y = distance_to(middle.y, reach, float(bake.size.y));
  return bake.aspect * x * x + y * y;
}

// Whether a texel under the node may lower the key.
bool may_improve(int level, ivec2 node) {
  if (any(greaterThanEqual(node, nodes_at(level)))) return false;
  if (level >= bake.top_level) return true;  // the root
  float rise = node_at(0, level, node) - owner_height;
  return rise > 0.0 && distance2_to(node << level, float(1 << level)) < limit * rise * rise;
}

// Gets the next target's ray ready. returns: whether it is worth a walk
bool begin(ivec2 texel, out Ray ray) {
  ray.offset = ivec2(offset_between(owner.x, texel.x, bake.size.x), offset_between(owner.y, texel.y, bake.size.y));
  ray.distance2 = distance2_to(texel, 1.0);
  ray.top = height_at(texel);
  ray.travel = 1.0 / (1.0 - ray.top);
  float rise = ray.top - owner_height;
  if (rise <= 0.0 || ray.distance2 >= limit * rise * rise) return false;
  if (ray.top < 1.0) return true;
  // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
  lower_least(ray, 0);
  return false;
}

// Walks the rays of all targets that wait.
void walk_rays() {
  barrier();
  uint count = target_count;
  Ray ray;
  for (int at = 0;;) {
    if (at == 0) {
      uint next = atomicAdd(next_target, 1u);
      if (next >= count) break;
      refresh_limit();
      if (!begin(unpacked(targets[next]), ray)) continue;
    }
    at = is_last_step(ray, at + 1) ? 0 : at + 1;
  }
  barrier();
  if (lane == 0) {
    target_count = 0u;
    next_target = 0u;
  }
  barrier();
}

void add_target(ivec2 texel) { targets[atomicAdd(target_count, 1u)] = packed(texel); }

// The texels of the blocks that wait.
void look_into_blocks() {
  barrier();
  int count = int(block_count);
  for (int i = 0; i < count; ++i) {
    ivec2 texel = (unpacked(blocks[i]) << BLOCK_LEVEL) + place_in_group(lane);
    if (may_improve(0, texel)) add_target(texel);
    // A queue that the next block could overfill is worked off.
    if ((i + 1) % QUEUED_BLOCKS == 0) walk_rays();
  }
  walk_rays();
  if (lane == 0) block_count = 0u;
  barrier();
}

// The blocks of the fields that wait.
void look_into_fields() {
  barrier();
  uint count = field_count;
  for (uint i = 0u; i < count; ++i) {
    refresh_limit();
    ivec2 block = (unpacked(fields[i]) << (FIELD_LEVEL - BLOCK_LEVEL)) + place_in_group(lane);
    if (may_improve(BLOCK_LEVEL, block)) blocks[atomicAdd(block_count, 1u)] = packed(block);
    look_into_blocks();
  }
  if (lane == 0) field_count = 0u;
  barrier();
}

void main() {
  owner = ivec2(gl_WorkGroupID.x, first_group_row + int(gl_WorkGroupID.y));
  owner_height = height_at(owner);
  lane = int(gl_LocalInvocationIndex);
  least_key = bake.widest_key;
  least_keys[lane] = -1.0lf;
  if (lane == 0) {
    shared_limit = floatBitsToUint(limit_of(least_key));
    field_count = 0u;
    block_count = 0u;
    target_count = 0u;
    next_target = 0u;
  }
  barrier();
  refresh_limit();

  // The texels round the owner come first: what they allow leaves most others out.
  ivec2 near = wrapped(owner + place_in_group(lane) - GROUP_SIDE / 2);
  if (may_improve(0, near)) add_target(near);
  walk_rays();
  ivec2 grid = nodes_at(FIELD_LEVEL);
  for (int first = 0; first < grid.x * grid.y; first += LANES) {
    refresh_limit();
    int i = first + lane;
    ivec2 field = ivec2(i % grid.x, i / grid.x);
    if (may_improve(FIELD_LEVEL, field)) fields[atomicAdd(field_count, 1u)] = packed(field);
    look_into_fields();
  }

  // A device that leaves loops before their end, as llvmpipe does after 65,535 turns of all of them together, leaves
  // this one too, and CUT_SHORT in the ratio's place.
  for (int turn = 0;; ++turn) {
    if (turn < bake.pyramids) continue;
    least_keys[lane] = least_key;
    break;
  }
  barrier();
  for (int i = 0; lane == 0 && least_keys[i] >= 0.0lf; ++i) {
    least_key = min(least_key, least_keys[i]);
    if (i < bake.pyramids * LANES - 1) continue;
    store_key(owner, least_key);
    break;
  }
}
