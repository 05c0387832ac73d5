#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_cone.glsl"
#include "bake_ray.glsl"

// The relaxed cone map of [PO07], to the bit as kernels/maps/bake_relaxed_po07.cpp has it.
//
// A workgroup makes one texel. Its invocations look for targets together, and each takes the next ray as it is done
// with its last: rays differ so much in length that invocations with a texel each would mostly wait for one another.

const int LANES = GROUP_SIDE * GROUP_SIDE;
const int LEVELS_DOWN = 3;  // of the pyramid: a node has one such descendant a lane
const int MOST_NODES = LANES * (MOST_LEVELS / LEVELS_DOWN + 1);
const int MOST_WAITING = 3 * LANES;
const int STEPS_A_TURN = 4;  // of a ray before its lane waits for the others

shared uint shared_limit;           // as bits, whose order is that of the floats
shared uint nodes[MOST_NODES];      // that are to be looked under: a stack, of one node's descendants a level at most
shared uint waiting[MOST_WAITING];  // targets whose rays are to be walked
shared uint node_count;
shared uint waiting_count;
shared uint next_waiting;
shared double least_keys[LANES];
shared uint least_targets[LANES];

int lane;
ivec2 owner;  // the texel whose cone it is
float owner_height;
float limit;        // keys from here on are no better than the best
double least_key;   // of this lane's rays
uint least_target;  // and the ray's

float limit_of(double key) { return float(key / weight_y) * (1.0 + 2.0 * KEY_ERROR); }
void refresh_limit() { limit = min(limit, uintBitsToFloat(atomicMin(shared_limit, floatBitsToUint(limit)))); }
void lower_limit(float key) {
  limit = min(limit, key);
  atomicMin(shared_limit, floatBitsToUint(limit));
}

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

// A target's ray where it has left.
void lower_least(uint target, float at) {
  double key = exact_key(ray_between(owner, owner_height, unpacked(target)), at);
  if (key >= least_key) return;
  least_key = key;
  least_target = target;
  lower_limit(limit_of(key));
}

// Walks the rays of all targets that wait. Where lanes run together, what stands in a branch may cost as much as if all
// took it: so double precision stands outside of the loop that walks, which a lane leaves when it can no longer do
// without.
void walk_rays() {
  barrier();
  uint count = waiting_count;
  bool has_more = true;
  uint target;
  Ray ray;
  float at = 0.0;
  int state = ENDED;
  // A ray that has left the relief, where its key waits.
  uint left_target;
  float left_at;
  bool has_left = false;
  while (has_more || has_left) {
    bool is_stuck = false;
    while (has_more && !is_stuck) {
      if (state == ENDED) {
        uint next = atomicAdd(next_waiting, 1u);
        has_more = next < count;
        refresh_limit();
        if (has_more) {
          target = waiting[next];
          ray = ray_between(owner, owner_height, unpacked(target));
          bool is_in_vain = ray.top <= owner_height || key_bounds(ray, 0.0).x >= limit;
          state = is_in_vain ? ENDED : state_at_target(ray);
        }
        at = 0.0;
      }
      for (int turn = 0; turn < STEPS_A_TURN && state == GOES_ON; ++turn) {
        at += 1.0;
        state = state_at(ray, at, limit, search_steps);
      }
      if (state == HAS_LEFT && !has_left) {
        left_target = target;
        left_at = at;
        has_left = true;
        lower_limit(key_bounds(ray, at).y);
        state = ENDED;
      }
      is_stuck = state == UNDECIDED || state == HAS_LEFT;
    }
    if (has_left) lower_least(left_target, left_at);
    has_left = false;
    if (state == UNDECIDED) state = exact_has_left(ray, at) ? HAS_LEFT : GOES_ON;
  }
  barrier();
  if (lane == 0) {
    waiting_count = 0u;
    next_waiting = 0u;
  }
  barrier();
}

void add_target(uint target) { waiting[atomicAdd(waiting_count, 1u)] = target; }

// That of a texel that is done: two are round an owner that is between them along one axis, four round others.
void add_guess(int i) {
  ivec2 corner = ivec2(i & 1, i >> 1);
  ivec2 texel = owner + stride * is_between * (2 * corner - 1);
  if (is_first_grid || any(greaterThan(corner, is_between)) || any(greaterThanEqual(uvec2(texel), uvec2(sides))))
    return;
  uint target = targets[index_of(texel)];
  if (target != NO_TARGET) add_target(target);
}

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
      add_target(packed(place));
    } else {
      nodes[atomicAdd(node_count, 1u)] = packed_node(level, place);
    }
  }
  barrier();
}

void main() {
  owner = on_grid(ivec2(gl_WorkGroupID.x, first_group_row + int(gl_WorkGroupID.y)));
  if (is_outside(owner)) return;
  owner_height = height_at(owner);
  lane = int(gl_LocalInvocationIndex);
  least_key = widest_key;
  least_target = NO_TARGET;
  limit = limit_of(least_key);
  least_keys[lane] = -1.0lf;
  if (lane == 0) {
    shared_limit = floatBitsToUint(limit);
    nodes[0] = packed_node((top_level + LEVELS_DOWN - 1) / LEVELS_DOWN * LEVELS_DOWN, ivec2(0));
    node_count = 1u;
    waiting_count = 0u;
    next_waiting = 0u;
  }
  barrier();

  // What is near comes first: what it allows leaves most others out.
  if (lane < 4) add_guess(lane);
  ivec2 near = wrapped(owner + place_in_group(lane) - GROUP_SIDE / 2);
  if (may_improve(0, near)) add_target(packed(near));
  bool is_last = false;
  while (!is_last) {
    walk_rays();
    refresh_limit();
    is_last = node_count == 0u;
    while (node_count > 0u && waiting_count <= uint(MOST_WAITING - LANES)) look_under_node();
  }

  // A device that leaves loops before their end, as llvmpipe does after 65,535 turns of all of them together, leaves
  // this one too, and CUT_SHORT in the ratio's place.
  for (int turn = 0;; ++turn) {
    if (turn < bake.pyramids) continue;
    least_keys[lane] = least_key;
    least_targets[lane] = least_target;
    break;
  }
  barrier();
  for (int i = 0; lane == 0 && least_keys[i] >= 0.0lf; ++i) {
    if (least_keys[i] < least_key) least_target = least_targets[i];
    least_key = min(least_key, least_keys[i]);
    if (i < bake.pyramids * LANES - 1) continue;
    ratios[index_of(owner)] = ratio_of(least_key);
    targets[index_of(owner)] = least_target;
    break;
  }
}
