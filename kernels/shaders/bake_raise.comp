#version 450
#extension GL_GOOGLE_include_directive : require
#include "bake_finer.glsl"

// One turn of raising texels, which `argument` names: see RaisingTurns (kernels/maps/certified_cones.h). No texel of a
// turn reads what another one of it writes.

struct Weight {
  float share;
  float stretch;
};
layout(BINDING(FIRST_BUFFER_BINDING + 1), std430) readonly buffer Limits { float limits[]; };
layout(BINDING(FIRST_BUFFER_BINDING + 2), std430) readonly buffer Weights { Weight weights[]; };  // x, then y
layout(BINDING(FIRST_BUFFER_BINDING + 3), std430) buffer Ratios { float ratios[]; };

Weight weight_x(int points) { return weights[points]; }
Weight weight_y(int points) { return weights[by.x + 1 + points]; }

int turns_along(int side) { return repeats && side % 2 == 1 ? 3 : 2; }
// Along an axis, the i-th place of a turn; from the side on: there is none.
int place_in_turn(int turn, int i, int side) {
  int last = side - 1;
  if (turn == 2) return last + i;
  int place = 2 * i + turn;
  return turns_along(side) == 3 && place == last ? side : place;
}
ivec2 texel_in_turn(ivec2 own) {
  if (argument == BEFORE_ALL_TURNS) return own;
  int turns = turns_along(map_sides.x);
  return ivec2(place_in_turn(argument % turns, own.x, map_sides.x),
               place_in_turn(argument / turns, own.y, map_sides.y));
}

float least;  // what the texel may be raised by; before all turns, what it begins with
bool is_cut_short;

// All points from the texel to its neighbours along two directions of the axes.
void look_at(ivec2 texel, ivec2 directions) {
  ivec2 other = texel + directions;
  float here = ratios[map_layered(texel)];
  float across = ratios[map_layered(ivec2(other.x, texel.y))];
  float along = ratios[map_layered(ivec2(texel.x, other.y))];
  float far = ratios[map_layered(other)];
  // Those on an axis are looked at once.
  ivec2 first = ivec2(lessThan(directions, ivec2(0)));
  for (int i = first.x; i < by.x; ++i) {
    Weight here_x = weight_x(i);
    float there_x = weight_x(by.x - i).share;
    precise float near_row = here * here_x.share + across * there_x;
    precise float far_row = along * here_x.share + far * there_x;
    for (int j = first.y; j < by.y; ++j) {
      ivec2 point = texel * by + directions * ivec2(i, j);
      if (!repeats && (any(lessThan(point, ivec2(0))) || is_outside(point))) continue;
      Weight here_y = weight_y(j);
      float limit = limits[layered(wrapped(point))];
      precise float ratio = near_row * here_y.share + far_row * weight_y(by.y - j).share;
      precise float room = (limit - ratio) * (here_x.stretch * here_y.stretch);
      is_cut_short = is_cut_short || limit == CUT_SHORT;
      least = min(least, argument == BEFORE_ALL_TURNS ? limit : room);
    }
  }
}

void main() {
  ivec2 texel = texel_in_turn(own_texel());
  if (any(greaterThanEqual(texel, map_sides))) return;
  least = WIDE;
  is_cut_short = false;
  for (int i = 0; i < 4; ++i) look_at(texel, 2 * ivec2(i & 1, i >> 1) - 1);
  int place = map_layered(texel);
  if (is_cut_short)
    ratios[place] = CUT_SHORT;
  else if (argument == BEFORE_ALL_TURNS)
    ratios[place] = least;
  else
    ratios[place] += max(least, 0.0);
}
