// A mesh: what stands at its corners, linear between them. C++ twin: mesh_ray() of mesh_tracer.cpp.
#include "mesh.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec3 in_u_gradient;
layout(location = 3) in vec3 in_v_gradient;
layout(location = 4) in vec2 in_uv;
layout(location = 5) in vec3 in_curvature;

bool enter(vec3 from, vec3 direction, out float way) {
  precise vec3 to = on_surface(in_position) - from;
  precise float along = dot(to, direction) / dot(direction, direction);
  way = along;
  return true;
}

// normal: unit
Place mesh_place(MeshCorner corner, vec3 normal) {
  const float NOTHING = 1e-12;
  precise vec3 u_gradient = corner.u_gradient - normal * dot(normal, corner.u_gradient);
  precise vec3 v_gradient = corner.v_gradient - normal * dot(normal, corner.v_gradient);
  precise vec2 lengths = max(vec2(length(u_gradient), length(v_gradient)), NOTHING);
  precise vec3 tangent_u = u_gradient / lengths.x;
  precise vec3 tangent_v = v_gradient / lengths.y;
  Place place;
  place.normal = normal;
  place.tangent_u = tangent_u;
  place.tangent_v = tangent_v;
  place.uv = corner.uv;
  place.scale = 1.0 / lengths;
  place.curvature = 2.0 * corner.curvature.xy;
  place.mixed = 2.0 * corner.curvature.z;
  place.height = 1.0;
  return place;
}

// Near a coarse mesh's outline normals look away: such a one is turned until it does not.
Place place_of(vec3 point) {
  precise vec3 direction = normalize(point - on_surface(frame.position.xyz));
  precise vec3 normal = normalize(in_normal);
  precise float away = dot(normal, direction) + LEAST_COSINE;
  if (away > 0.0) normal = normalize(normal - away * direction);
  return mesh_place(MeshCorner(in_position, in_normal, in_u_gradient, in_v_gradient, in_uv, in_curvature), normal);
}

#ifdef HAS_EXACT_HITS
// Of this pixel's exact hit. point: where it is
Place exact_place(vec3 point) {
  vec4 hit = texelFetch(reference_map, ivec2(gl_FragCoord.xy), 0);
  vec3 weights = vec3(1.0 - hit.z - hit.w, hit.z, hit.w);
  MeshCorner sum = MeshCorner(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec2(0.0), vec3(0.0));
  for (int i = 0; i < 3; ++i) {
    MeshCorner corner = mesh_corner(3 * int(hit.y + 0.5) + i);
    sum.position += weights[i] * corner.position;
    sum.normal += weights[i] * corner.normal;
    sum.u_gradient += weights[i] * corner.u_gradient;
    sum.v_gradient += weights[i] * corner.v_gradient;
    sum.uv += weights[i] * corner.uv;
  }
  Place place = mesh_place(sum, normalize(sum.normal));
  place.height = 1.0 - dot(on_surface(sum.position) - point, place.normal) / max(surface_relief(), 1e-12);
  return place;
}
#endif
