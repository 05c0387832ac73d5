// A mesh's corners as they lie in mesh_map: kernels/mesh/meshes.h.
#include "mesh_contract.glsl"

struct MeshCorner {
  vec3 position;
  vec3 normal;
  vec3 u_gradient;  // where u grows most: how far along a unit of length, in sides of the unit square
  vec3 v_gradient;
  vec2 uv;
  vec3 curvature;  // (a, b, c) of -(a x^2 + b y^2 + c x y) along both gradients
};

vec4 mesh_texel(int place) {
  return texelFetch(mesh_map, ivec2(place & ((1 << MESH_WIDTH_BITS) - 1), place >> MESH_WIDTH_BITS), 0);
}

// corner: three a triangle
vec3 mesh_position(int corner) { return mesh_texel(MESH_TEXELS * corner).xyz; }

MeshCorner mesh_corner(int corner) {
  int place = MESH_TEXELS * corner;
  vec4 position = mesh_texel(place);
  vec4 normal = mesh_texel(place + 1);
  vec4 u_gradient = mesh_texel(place + 2);
  vec4 v_gradient = mesh_texel(place + 3);
  return MeshCorner(position.xyz, normal.xyz, u_gradient.xyz, v_gradient.xyz, vec2(position.w, normal.w),
                    vec3(u_gradient.w, v_gradient.w, mesh_texel(place + 4).x));
}
