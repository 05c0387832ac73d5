// Relief mapping as a material of Bevy. SPDX-License-Identifier: MIT-0
#import bevy_pbr::forward_io::VertexOutput
#import bevy_pbr::mesh_view_bindings::view
#import relief::trace::relief_trace
?map #import relief::trace::relief_normal

// xyz: towards the light, in the world; w: depth of the relief, in sides of a tile
@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> light_and_depth: vec4<f32>;
?map @group(#{MATERIAL_BIND_GROUP}) @binding(1) var relief_map: texture_2d<f32>;
?map @group(#{MATERIAL_BIND_GROUP}) @binding(2) var relief_sampler: sampler;
?extra @group(#{MATERIAL_BIND_GROUP}) @binding(3) var extra_map: texture_2d<f32>;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
  let normal = normalize(in.world_normal);
  let tangent = normalize(in.world_tangent.xyz);
  // Bevy's bitangent runs against v.
  let frame = mat3x3<f32>(tangent, -cross(normal, tangent) * in.world_tangent.w, normal);
  let view_ts = (in.world_position.xyz - view.world_position) * frame;
  let light_ts = normalize(light_and_depth.xyz * frame);
  let surface = relief_trace(@args@in.uv, view_ts, light_and_depth.w@light_arg@);
?clamp   if (any(in.uv < vec2<f32>(0.0)) || any(in.uv > vec2<f32>(1.0))) {
?clamp     discard;
?clamp   }
?map   let normal_ts = relief_normal(@normal_args@surface.uv, light_and_depth.w);
!map   let normal_ts = vec3<f32>(0.0, 0.0, 1.0);
  var diffuse = max(dot(normal_ts, light_ts), 0.0);
?shadow   diffuse *= surface.shadow;
  return vec4<f32>(vec3<f32>(0.62, 0.55, 0.48) * (0.25 + 0.85 * diffuse), 1.0);
}
