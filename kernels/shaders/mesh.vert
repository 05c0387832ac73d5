#version 450
#extension GL_GOOGLE_include_directive : require
#define CURVED  // the block is the fragment shader's
#include "platform.glsl"
#include "contract.glsl"
#include "eye.glsl"
#include "mesh.glsl"

// The triangles of a mesh that are seen from outside; others are clipped.
layout(location = 0) out vec3 out_position;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec3 out_u_gradient;
layout(location = 3) out vec3 out_v_gradient;
layout(location = 4) out vec2 out_uv;
layout(location = 5) out vec3 out_curvature;

bool is_seen(int first) {
  precise vec3 from = mesh_position(first);
  precise vec3 normal = cross(mesh_position(first + 1) - from, mesh_position(first + 2) - from);
  return dot(normal, from - frame.position.xyz) < 0.0;
}

void main() {
  MeshCorner corner = mesh_corner(VERTEX_INDEX);
  out_position = corner.position;
  out_normal = corner.normal;
  out_u_gradient = corner.u_gradient;
  out_v_gradient = corner.v_gradient;
  out_uv = corner.uv;
  out_curvature = corner.curvature;
  if (!is_seen(VERTEX_INDEX / 3 * 3)) {
    gl_Position = vec4(0.0, 0.0, -1.0, 1.0);
    return;
  }
  // In the frame's axes. Where rays are shifted within their pixels, `forward` is not across the other two.
  vec3 right = frame.right.xyz / dot(frame.right.xyz, frame.right.xyz);
  vec3 up = frame.up.xyz / dot(frame.up.xyz, frame.up.xyz);
  vec2 shift = vec2(dot(frame.forward.xyz, right), dot(frame.forward.xyz, up));
  vec3 axis = frame.forward.xyz - frame.right.xyz * shift.x - frame.up.xyz * shift.y;
  vec3 seen = corner.position - frame.position.xyz;
  float depth = dot(seen, axis);
  vec2 planes = near_and_far();
  float scale = planes.y / (planes.y - planes.x);
  // y runs down the frame, as eye_direction() has it.
  gl_Position =
      vec4(dot(seen, right) - shift.x * depth, shift.y * depth - dot(seen, up), scale * (depth - planes.x), depth);
}
