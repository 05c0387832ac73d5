#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_search.glsl"
#include "bake_ray.glsl"

// The relaxed cone map of [PO07] on a software rasteriser, to the bit as bake_relaxed_po07.comp has it. There memory
// that a workgroup shares is slow, and few invocations run at a time: so none shares anything. Each searches for a
// packet until some quads with targets wait, then walks the rays through all of them. Double precision stands outside
// of the loops that walk: where lanes run together, what stands in a branch may cost as much as if all took it.
//
// Some packets take far longer than most. A pass leaves them where they are, and the next one over the same grid goes
// on there.

// Where a search is left.
struct Search {
  uvec2 waiting;
  uint nears;
  int level;
  ivec2 quad;
  int round;  // DONE: there is nothing to go on with
  int rounds;
};
layout(BINDING(FIRST_BUFFER_BINDING + 6), std430) buffer Searches { Search searches[]; };
const int DONE = -2;

bool goes_on = argument < 0;

// Of loops. llvmpipe leaves them all after 65,535 turns together, by eight lanes of which any may make a turn alone.
int turns_left = 7000;

// Quads whose targets' rays are to be walked, the last one first: their places, packed, and 16 bits of pairs each, bit
// 4 i + k for texel i and owner k.
uvec4 quads_that_wait = uvec4(0u);
uvec2 pairs_that_wait = uvec2(0u);

// A ray of an owner's on its way, or where it has left.
struct Walk {
  int owner;
  uint target;
  float at;
};
Walk walk;
Ray ray;
int state = ENDED;

// The least keys are within [low_keys, keys], of these.
vec4 low_keys;
uvec4 best_targets = uvec4(NO_TARGET);
vec4 best_ats = vec4(0.0);
// One that float cannot tell from the best.
Walk unsure;
bool has_unsure = false;

// Packets without good first guesses have a round before, of rays that leave the relief at the first step. Those are
// cheap to walk, and among them is most often one whose key is little over the least.
int search_rounds;
float most_steps;
int rounds() { return search_rounds; }
void start_round(int round) {
  pyramid = 0;
  most_steps = round < search_rounds - 1 ? 1.0 : search_steps;
}
bvec4 counts(ivec2 first, ivec2 x, ivec2 y, int size) { return bvec4(true); }
vec2 distances_along(int axis, vec2 offsets, float reach) { return distances_to(offsets, reach, vec2(sides[axis])); }

bool has_quads() { return pairs_that_wait.x != 0u; }
bool is_full() { return pairs_that_wait.y > 0xffffu; }
void add_quad(uint place, uint pairs) {
  quads_that_wait = uvec4(place, quads_that_wait.xyz);
  pairs_that_wait = (pairs_that_wait << 16) | uvec2(pairs, pairs_that_wait.x >> 16);
}

// Looks at keys where rays can leave at the earliest, one step below their targets.
void offer(vec4 offered[4], vec4 low_x, vec4 high_x, vec4 low_y, vec4 high_y) {
  vec4 falls = mix(vec4(0.0), looked_tops * step_share, lessThan(looked_tops, vec4(1.0)));
  vec4 scales = 1.0 + falls / max(1.0 - looked_tops, 1e-6);
  vec4 scales2 = scales * scales * (1.0 - 4.0 * KEY_ERROR);
  vec4 tops = looked_tops - falls + Z_ERROR;
  uint pairs = 0u;
  for (int i = 0; i < 4; ++i) {
    vec4 square = distances2((i & 1) == 0 ? low_x : high_x, i < 2 ? low_y : high_y) * scales2[i];
    vec4 rises = max(tops[i] - eyes, 0.0);
    bvec4 may_improve = lessThan(square, keys * rises * rises);
    pairs |= bits_of(may_improve) << (4 * i);
  }
  if (pairs != 0u) add_quad(packed(looked_first), pairs);
}

Ray ray_of(Walk w) { return ray_between(owner_at(w.owner), component(owner_heights, w.owner), unpacked(w.target)); }

void begin_next() {
  uint bit = uint(findLSB(pairs_that_wait.x));
  walk = Walk(int(bit & 3u), quads_that_wait.x + ((bit >> 2) & 1u) + ((bit >> 3) << 16), 0.0);
  pairs_that_wait.x &= pairs_that_wait.x - 1u;
  if ((pairs_that_wait.x & 0xffffu) == 0u) {
    pairs_that_wait = (pairs_that_wait >> 16) | uvec2(pairs_that_wait.y << 16, 0u);
    quads_that_wait = uvec4(quads_that_wait.yzw, 0u);
  }
  ray = ray_of(walk);
  state = state_at_target(ray);
}

void set_bounds(int owner, vec2 bounds) {
  low_keys = mix(low_keys, vec4(bounds.x), is_owner(owner));
  keys = mix(keys, vec4(bounds.y), is_owner(owner));
}
void take_best(Walk w) {
  best_targets = mix(best_targets, uvec4(w.target), is_owner(w.owner));
  best_ats = mix(best_ats, vec4(w.at), is_owner(w.owner));
}

// Where the ray has left.
void offer_key() {
  vec2 bounds = key_bounds(ray, walk.at);
  vec2 least = vec2(component(low_keys, walk.owner), component(keys, walk.owner));
  if (bounds.x >= least.y || walk.target == component(best_targets, walk.owner)) {
    state = ENDED;
  } else if (bounds.y <= least.x) {
    take_best(walk);
    set_bounds(walk.owner, bounds);
    state = ENDED;
  } else if (!has_unsure) {
    unsure = walk;
    has_unsure = true;
    set_bounds(walk.owner, min(bounds, least));
    state = ENDED;
  }
}

// Some steps of a ray that goes on. None waits for what another one finds, so that a processor makes them side by side.
void walk_steps() {
  const int STEPS = 5;
  float limit = component(keys, walk.owner);
  int states[STEPS];
  for (int i = 0; i < STEPS; ++i) states[i] = state_at(ray, walk.at + float(i + 1), limit, most_steps);
  for (int i = 0; i < STEPS; ++i) {
    bool makes_step = state == GOES_ON;
    walk.at += makes_step ? 1.0 : 0.0;
    state = makes_step ? states[i] : state;
  }
}

// Walks the rays through all targets that wait, as far as float tells.
void walk_rays() {
  bool is_stuck = false;
  while ((has_quads() || state != ENDED) && !is_stuck) {
    if (state == HAS_LEFT) offer_key();
    if (state == ENDED && has_quads()) begin_next();
    walk_steps();
    is_stuck = state == UNDECIDED || (state == HAS_LEFT && has_unsure);
    turns_left -= 1;
  }
}

double least_key(int owner) {
  Walk best = Walk(owner, component(best_targets, owner), component(best_ats, owner));
  return best.target == NO_TARGET ? widest_key : exact_key(ray_of(best), best.at);
}

// What float could not.
void decide() {
  if (has_unsure) {
    double key = exact_key(ray_of(unsure), unsure.at);
    double best = least_key(unsure.owner);
    if (key < best) take_best(unsure);
    float least = float(min(key, best) / weight_y);
    set_bounds(unsure.owner, least * vec2(1.0 - 2.0 * KEY_ERROR, 1.0 + 2.0 * KEY_ERROR));
    has_unsure = false;
  }
  if (state == UNDECIDED) state = exact_has_left(ray, walk.at) ? HAS_LEFT : GOES_ON;
}

bool has_rays() { return has_quads() || state != ENDED || has_unsure; }

// Adds the targets of packets that are done; or the packet's own ones where a search goes on, as if they were guesses.
// returns: the greatest ratio that one is of; 0: there are none
float add_guesses() {
  float ratio = 0.0;
  ivec2 first = first_texel();
  ivec2 low = goes_on ? first : first - is_between * (2 * stride - 1);
  ivec2 high = goes_on ? first + 1 : first + 1 + is_between * (2 * stride - 1);
  for (int i = 0; i < 4; ++i) {
    ivec2 texel = ivec2((i & 1) == 0 ? low.x : high.x, i < 2 ? low.y : high.y);
    if (is_outside(texel)) continue;
    uint target = targets[index_of(texel)];
    if (target == NO_TARGET) continue;
    add_quad(target, 15u);
    ratio = max(ratio, ratios[index_of(texel)]);
  }
  return ratio;
}

void main() {
  packet = on_grid(own_texel());
  if (is_outside(first_texel())) return;
  int place = packet.y * nodes_at(1).x + packet.x;
  if (goes_on && searches[place].round == DONE) return;
  start(first_texel(), last_texel());
  keys = limits();
  low_keys = keys * (1.0 - 8.0 * KEY_ERROR);
  most_steps = search_steps;
  float guess = goes_on || !is_first_grid ? add_guesses() / bake.rows_to_ratio : 0.0;
  walk_rays();
  decide();
  const float FAR_OFF = 2.0 * 2.0;  // of a key to that of a guess
  bvec4 is_inside = lessThan(owner_heights, vec4(ABOVE_ALL));
  search_rounds = any(both(is_inside, greaterThan(keys, vec4(FAR_OFF * guess * guess)))) ? 2 : 1;
  start_search();
  Branch at = start_of_image;
  if (goes_on) {
    Search s = searches[place];
    waiting = s.waiting;
    nears = s.nears;
    at = Branch(s.level, s.quad);
    round_number = s.round;
    search_rounds = s.rounds;
    start_round(round_number);
  }
  bool is_done = false;
  while ((!is_done && turns_left > 0) || has_rays()) {
    while (!is_done && turns_left > 0 && !is_full()) {
      is_done = !next(at);
      if (!is_done) visit(at);
      turns_left -= 1;
    }
    walk_rays();
    decide();
    turns_left -= 1;
  }
  bool is_whole = !has_rays();
  for (int k = 0; k < 4; ++k) {
    ivec2 texel = texel_of(k);
    if (is_outside(texel)) continue;
    targets[index_of(texel)] = best_targets[k];
    if (is_done && is_whole) ratios[index_of(texel)] = ratio_of(least_key(k));
  }
  searches[place] =
      Search(waiting, nears, at.level, at.quad, is_done || !is_whole ? DONE : round_number, search_rounds);
}
