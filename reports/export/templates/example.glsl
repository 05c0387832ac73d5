
layout(location = 0) in vec2 in_uv;        // of the plane, in tiles
layout(location = 1) in vec3 in_view_ts;   // from the eye to the plane, in tangent space
layout(location = 2) in vec3 in_light_ts;  // towards the light, in tangent space
?curvature layout(location = 3) in vec3 in_curvature;  // of the surface, per side of a tile
?animated layout(location = 4) flat in int in_frame;  // the number of the frame that is drawn, counted up
layout(location = 0) out vec4 out_color;
?conservative // No hit is nearer than the plane, so that fragments may be rejected by the plane's depth before they run.
?conservative layout(depth_greater) out float gl_FragDepth;

void main() {
  vec3 light = normalize(in_light_ts);
?fragdepth   float eye_depth = 1.0 / gl_FragCoord.w;  // along the camera's axis
?fragdepth   // Whose view_ts has the length of the way from the eye, in sides of a tile.
?fragdepth   vec2 eye_depths = vec2(eye_depth, eye_depth * @depth@ / -in_view_ts.z);
  ReliefSurface surface = relief_trace(@maps@in_uv, in_view_ts, @depth@@curvature@@lights@@depths@);
?clamp   if (any(lessThan(in_uv, vec2(0.0))) || any(greaterThan(in_uv, vec2(1.0)))) discard;
?passes   if (surface.passes) discard;
?map   vec3 normal = relief_normal(@normal_maps@surface.uv, @depth@);
!map   vec3 normal = vec3(0.0, 0.0, 1.0);
  float diffuse = max(dot(normal, light), 0.0);
?shadow   diffuse *= surface.shadow;
?write   gl_FragDepth = surface.depth;
?conservative   gl_FragDepth = max(surface.depth, gl_FragCoord.z);
  out_color = vec4(vec3(0.62, 0.55, 0.48) * (0.25 + 0.85 * diffuse), 1.0);
}
