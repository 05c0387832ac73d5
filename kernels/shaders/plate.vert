#version 450
#extension GL_GOOGLE_include_directive : require
#include "platform.glsl"
#include "contract.glsl"
#include "eye.glsl"

// The top plate as a triangle over the whole frame: its depth, far / (far - near) * (1 - near / depth), is linear over
// the frame, since 1 / depth is. A little nearer than it is, so that rounding brings no hit before it.
const float NEARER = 1.9073486328125e-6;  // 2^-19, of the greatest number in it; rasterisers round by 2^-23

void main() {
  vec2 corner = vec2((VERTEX_INDEX << 1) & 2, VERTEX_INDEX & 2) * 2.0 - 1.0;
  vec2 planes = near_and_far();
  float height = frame.position.z;
  if (height < 1e-6 * planes.x) {  // an eye on the plate or under it sees nothing of its upper side: it is clipped
    gl_Position = vec4(corner, -1.0, 1.0);
    return;
  }
  float scale = planes.y / (planes.y - planes.x);
  // Of pixels whose y runs down the frame, as eye_direction() has them.
  vec3 direction = frame.forward.xyz + frame.right.xyz * corner.x - frame.up.xyz * corner.y;
  float greatest = 1.0 + planes.x / height * (abs(frame.forward.z) + 3.0 * (abs(frame.right.z) + abs(frame.up.z)));
  gl_Position = vec4(corner, scale * (1.0 + planes.x / height * direction.z - NEARER * greatest), 1.0);
}
