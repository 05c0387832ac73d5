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

layout(BINDING(FIRST_BUFFER_BINDING + 4)) uniform samplerBuffer corners;  // bake_corners.comp

int search_steps = bake.search_steps;
float step_share = bake.step_share;

const int LANES = GROUP_SIDE * GROUP_SIDE;
const int LEVELS_DOWN = 3;  // of the pyramid: a node has one such descendant a lane
const int MOST_NODES = LANES * (MOST_LEVELS / LEVELS_DOWN + 1);
const int MOST_TARGETS = 3 * LANES;
const int STRIDE = 4;  // steps of a ray before its lane waits for the others

shared uint shared_limit;           // as bits, whose order is that of the floats
shared uint nodes[MOST_NODES];      // that are to be looked under: a stack, of one node's descendants a level at most
shared uint targets[MOST_TARGETS];  // that wait for their rays
shared uint node_count;
shared uint target_count;
shared uint next_target;
shared double least_keys[LANES];

int lane;
ivec2 owner;  // the texel whose cone it is
float owner_height;
float limit;       // keys from here on are no better than the best
double least_key;  // of this lane's rays

float limit_of(double key) { return float(key / weight_y) * (1.0 + 2.0 * KEY_ERROR); }
void refresh_limit() { limit = min(limit, uintBitsToFloat(atomicMin(shared_limit, floatBitsToUint(limit)))); }

// The cell that a position lies in; the position becomes that within the cell.
ivec2 cell_of(inout vec2 position) {
  vec2 size = vec2(sides);
  if (repeats) position -= size * floor(position / size);
  position = clamp(position, vec2(0.0), repeats ? size : size - 1.0);
  vec2 low = floor(position);
  position -= low;
  return wrapped(ivec2(low));
}

float surface(vec2 position) {
  int cell = index_of(cell_of(position));
  vec4 heights = texelFetch(corners, cell);
  vec2 along = mix(heights.xz, heights.yw, position.x);
  return mix(along.x, along.y, position.y);
}

// The same along one axis, without rounding.
struct ExactCell {
  int low;
  double fraction;
};

ExactCell exact_cell(double coordinate, int side) {
  if (!repeats) coordinate = clamp(coordinate, 0.0lf, double(side - 1));
  double whole = floor(coordinate);
  // Exact but for the quotient, which may be one off.
  precise double low = whole - double(side) * floor(whole / double(side));
  if (low < 0.0lf) low += double(side);
  if (low >= double(side)) low -= double(side);
  return ExactCell(int(low), coordinate - whole);
}

double lerp(double a, double b, double fraction) {
  precise double value = a + fraction * (b - a);
  return value;
}

double exact_surface(double x, double y) {
  ExactCell column = exact_cell(x, sides.x);
  ExactCell row = exact_cell(y, sides.y);
  dvec4 heights = dvec4(texelFetch(corners, index_of(ivec2(column.low, row.low))));
  double top = lerp(heights.x, heights.y, column.fraction);
  double bottom = lerp(heights.z, heights.w, column.fraction);
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
  precise double z = top * (1.0lf - divide(double(at), double(search_steps)));
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
  precise double distance2 = offset.x * offset.x * weight_x + offset.y * offset.y * weight_y;
  precise double scaled2 = distance2 * (point.scale * point.scale);
  precise double rise2 = rise * rise;
  double key = divide(scaled2, rise2);
  if (key >= least_key) return;
  least_key = key;
  limit = min(limit, limit_of(key));
  atomicMin(shared_limit, floatBitsToUint(limit));
}

const float Z_ERROR = 5e-7;  // of heights along a ray in float

// Lowers the limit by a key that lower_least() has yet to make.
void expect_key(Ray ray, int at) {
  float fallen = ray.top * (float(at) * step_share);
  float rise = ray.top - fallen - owner_height - Z_ERROR;
  float scale = at == 0 ? 1.0 : 1.0 + fallen * ray.travel;
  if (rise <= 0.0) return;
  limit = min(limit, ray.distance2 * (scale * scale) / (rise * rise) * (1.0 + 4.0 * KEY_ERROR));
  atomicMin(shared_limit, floatBitsToUint(limit));
}

float sum_of(vec2 v) { return abs(v.x) + abs(v.y); }

// What a ray does at a step.
const int GOES_ON = 0;
const int UNDECIDED = 1;  // by float: it has left the relief or goes on
const int HAS_LEFT = 2;
const int IN_VAIN = 3;  // it lowers no key any more

int state_at(Ray ray, int at) {
  const float OFFSET_ERROR = 4e-7;   // a share of the way from the owner
  const float PLACE_ERROR = 2.5e-7;  // and of the coordinate
  float fallen = ray.top * (float(at) * step_share);
  float z = ray.top - fallen;
  float rise = z - owner_height + Z_ERROR;
  float scale = 1.0 + fallen * ray.travel;
  // Farther on the ray is lower and farther away, so that the key only grows.
  if (rise <= 0.0 || ray.distance2 * (scale * scale) >= limit * (rise * rise)) return IN_VAIN;
  vec2 way = vec2(ray.offset) * scale;
  vec2 place = vec2(owner) + way;
  // A surface between heights of 0 and 1 is no steeper than 1 a texel along an axis.
  float error = 2.0 * Z_ERROR + OFFSET_ERROR * sum_of(way) + PLACE_ERROR * sum_of(place);
  float above = z - surface(place);
  if (at == search_steps || above > error) return HAS_LEFT;
  return above < -error ? GOES_ON : UNDECIDED;
}

int offset_between(int from, int to, int side) {
  int d = to - from;
  if (repeats && 2 * d > side) d -= side;
  if (repeats && 2 * d <= -side) d += side;
  return d;
}

uint packed(ivec2 place) { return uint(place.x) | (uint(place.y) << 16); }
ivec2 unpacked(uint place) { return ivec2(place & 0xffffu, place >> 16); }
ivec2 place_in_group(int i) { return ivec2(i % GROUP_SIDE, i / GROUP_SIDE); }

float distance2_to(ivec2 first, float size) {
  float reach = 0.5 * (size - 1.0);
  vec2 middle = vec2(first - owner) + reach;
  vec2 distances = distances_to(middle, reach, vec2(sides));
  return aspect * distances.x * distances.x + distances.y * distances.y;
}

// Whether a texel under the node may lower the key; no node is before the map or behind it.
bool may_improve(int level, ivec2 node) {
  if (any(greaterThanEqual(uvec2(node), uvec2(nodes_at(level))))) return false;
  float rise = node_at(0, level, node) - owner_height;
  return rise > 0.0 && distance2_to(node << level, float(1 << level)) < limit * rise * rise;
}

// Gets a target's ray ready. returns: its state at the target
int begin(ivec2 texel, out Ray ray) {
  ray.offset = ivec2(offset_between(owner.x, texel.x, sides.x), offset_between(owner.y, texel.y, sides.y));
  ray.distance2 = distance2_to(texel, 1.0);
  ray.top = height_at(texel);
  ray.travel = 1.0 / (1.0 - ray.top);
  float rise = ray.top - owner_height;
  if (rise <= 0.0 || ray.distance2 >= limit * rise * rise) return IN_VAIN;
  // At the top plate itself the ray runs level and enters nothing: the cone ends at the target.
  return ray.top < 1.0 ? GOES_ON : HAS_LEFT;
}

// Walks the rays of all targets that wait. Where lanes run together, what stands in a branch may cost as much as if all
// took it: so double precision stands outside of the loop that walks, which a lane leaves when it can no longer do
// without.
void walk_rays() {
  barrier();
  uint count = target_count;
  bool has_more = true;
  Ray ray;
  int at = 0;
  int state = IN_VAIN;
  // A ray that has left the relief, where its key waits.
  Ray left;
  int left_at;
  bool has_left = false;
  while (has_more || has_left) {
    bool is_stuck = false;
    while (has_more && !is_stuck) {
      if (state == IN_VAIN) {
        uint next = atomicAdd(next_target, 1u);
        has_more = next < count;
        refresh_limit();
        if (has_more) state = begin(unpacked(targets[next]), ray);
        at = 0;
      }
      for (int turn = 0; turn < STRIDE && state == GOES_ON; ++turn) {
        ++at;
        state = state_at(ray, at);
      }
      if (state == HAS_LEFT && !has_left) {
        left = ray;
        left_at = at;
        has_left = true;
        expect_key(ray, at);
        state = IN_VAIN;
      }
      is_stuck = state == UNDECIDED || state == HAS_LEFT;
    }
    if (has_left) lower_least(left, left_at);
    has_left = false;
    if (state == UNDECIDED) state = exact_has_left(ray, at) ? HAS_LEFT : GOES_ON;
  }
  barrier();
  if (lane == 0) {
    target_count = 0u;
    next_target = 0u;
  }
  barrier();
}

void add_target(ivec2 texel) { targets[atomicAdd(target_count, 1u)] = packed(texel); }

// Of levels from LEVELS_DOWN on, so that a place has three bits less than a texel's.
uint packed_node(int level, ivec2 node) { return uint(node.x) | (uint(node.y) << 13) | (uint(level) << 26); }

// Takes the last node that waits; what under it may lower the key waits instead, as nodes or as targets.
void look_under_node() {
  uint node = nodes[node_count - 1u];
  barrier();
  if (lane == 0) --node_count;
  barrier();
  int level = int(node >> 26) - LEVELS_DOWN;
  ivec2 place = (ivec2(node & 0x1fffu, (node >> 13) & 0x1fffu) << LEVELS_DOWN) + place_in_group(lane);
  if (may_improve(level, place)) {
    if (level == 0) {
      add_target(place);
    } else {
      nodes[atomicAdd(node_count, 1u)] = packed_node(level, place);
    }
  }
  barrier();
}

void main() {
  owner = ivec2(gl_WorkGroupID.x, first_group_row + int(gl_WorkGroupID.y));
  owner_height = height_at(owner);
  lane = int(gl_LocalInvocationIndex);
  least_key = widest_key;
  limit = limit_of(least_key);
  least_keys[lane] = -1.0lf;
  if (lane == 0) {
    shared_limit = floatBitsToUint(limit);
    nodes[0] = packed_node((top_level + LEVELS_DOWN - 1) / LEVELS_DOWN * LEVELS_DOWN, ivec2(0));
    node_count = 1u;
    target_count = 0u;
    next_target = 0u;
  }
  barrier();

  // The texels round the owner come first: what they allow leaves most others out.
  ivec2 near = wrapped(owner + place_in_group(lane) - GROUP_SIDE / 2);
  if (may_improve(0, near)) add_target(near);
  bool is_last = false;
  while (!is_last) {
    walk_rays();
    refresh_limit();
    is_last = node_count == 0u;
    while (node_count > 0u && target_count <= uint(MOST_TARGETS - LANES)) look_under_node();
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
    ratios[layered(owner)] = ratio_of(least_key);
    break;
  }
}
