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

float interpolated(ivec2 texel, ivec2 offset) {
  ivec2 points = abs(offset);
  ivec2 other = texel + ivec2(offset.x < 0 ? -1 : 1, offset.y < 0 ? -1 : 1);
  float here_x = weight_x(points.x).share;
  float here_y = weight_y(points.y).share;
  float there_x = weight_x(by.x - points.x).share;
  float there_y = weight_y(by.y - points.y).share;
  float here = ratios[map_layered(texel)];
  float across = ratios[map_layered(ivec2(other.x, texel.y))];
  float along = ratios[map_layered(ivec2(texel.x, other.y))];
  float far = ratios[map_layered(other)];
  precise float ratio = (here * here_x + across * there_x) * here_y + (along * here_x + far * there_x) * there_y;
  return ratio;
}

// What the texel may be raised by as far as one of its points is concerned; before all turns, what it begins with.
float room_at(ivec2 texel, ivec2 offset, float limit) {
  if (argument == BEFORE_ALL_TURNS) return limit;
  precise float stretch = weight_x(abs(offset.x)).stretch * weight_y(abs(offset.y)).stretch;
  precise float room = (limit - interpolated(texel, offset)) * stretch;
  return room;
}

void main() {
  ivec2 texel = texel_in_turn(own_texel());
  if (any(greaterThanEqual(texel, map_sides))) return;
  bool is_cut_short = false;
  float least = WIDE;
  for (int j = 1 - by.y; j < by.y; ++j)
    for (int i = 1 - by.x; i < by.x; ++i) {
      ivec2 point = texel * by + ivec2(i, j);
      if (!repeats && (any(lessThan(point, ivec2(0))) || is_outside(point))) continue;
      float limit = limits[layered(wrapped(point))];
      is_cut_short = is_cut_short || limit == CUT_SHORT;
      least = min(least, room_at(texel, ivec2(i, j), limit));
    }
  int place = map_layered(texel);
  if (is_cut_short)
    ratios[place] = CUT_SHORT;
  else if (argument == BEFORE_ALL_TURNS)
    ratios[place] = least;
  else
    ratios[place] += max(least, 0.0);
}
