#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "depth.glsl"
#include "eye.glsl"

// What stands beside the relief in frames with depth: a tilted square and a ball that cut through it, and the sky
// behind all. C++ twin: depth.cpp.
const int SQUARE = 0;  // in frame.forward.w
const int BALL = 1;    // anything else is the sky

layout(location = 0) out vec4 out_color;

ivec2 map_size() { return frame.sizes.zw; }

// Depth along the axis where the ray meets the square, from the bottom plate on its left to the top plate on its right.
float square_depth(vec3 direction, vec3 middle, float relief) {
  float rise = relief / SQUARE_SIDE;
  vec3 from = frame.position.xyz - (middle - vec3(SQUARE_SIDE, 0.0, 0.5 * relief));
  float depth = (rise * from.x - from.z) / (direction.z - rise * direction.x);
  vec2 place = from.xy + direction.xy * depth;
  return any(greaterThan(abs(place), vec2(0.5 * SQUARE_SIDE))) ? -1.0 : depth;
}

float ball_depth(vec3 direction, vec3 middle, float relief) {
  vec3 from = frame.position.xyz - (middle + vec3(BALL_RADIUS, 0.0, -0.5 * relief));
  float a = dot(direction, direction);
  float b = dot(direction, from);
  // The distance of the ray from the middle, squared: no difference of large squares.
  vec3 nearest = from - direction * (b / a);
  float inside = BALL_RADIUS * BALL_RADIUS - dot(nearest, nearest);
  return inside < 0.0 ? -1.0 : -b / a - sqrt(inside / a);
}

void main() {
  vec2 planes = near_and_far();
  int object = int(frame.forward.w);
  if (object != SQUARE && object != BALL) {
    out_color = vec4(0.55, 0.65, 0.80, 1.0);
    gl_FragDepth = FARTHEST;
    return;
  }
  vec3 direction = eye_direction(gl_FragCoord.xy);
  float relief = frame.position.w / frame.right.w;
  vec3 middle = frame.position.xyz + frame.forward.xyz * (planes.x / NEAR_PLANE);
  float depth = object == SQUARE ? square_depth(direction, middle, relief) : ball_depth(direction, middle, relief);
  if (!(depth >= planes.x)) discard;
  gl_FragDepth = window_depth(depth, planes);
  float shade = 0.8 + 0.2 * sin(40.0 * (frame.position.x + direction.x * depth));
  out_color =
      object == SQUARE ? vec4(0.75 * shade, 0.25, 0.20, SEEN_SQUARE) : vec4(0.20, 0.35, 0.75 * shade, SEEN_BALL);
}
