// Relief mapping as nodes of three.js' WebGPURenderer. SPDX-License-Identifier: MIT-0
import {float, parallaxDirection, sampler, texture, TBNViewMatrix, uv, vec3, wgsl, wgslFn} from 'three/tsl';

const library = wgsl(await (await fetch(new URL('relief.wgsl', import.meta.url))).text());

// x, y: uv of the hit; z: its height; w: what of the light comes there
const trace = wgslFn(
    `fn relief_node(@node_params@plane_uv: vec2<f32>, view_ts: vec3<f32>, depth: f32, light_ts: vec3<f32>) -> vec4<f32> {
  let surface = relief_trace(@args@plane_uv, view_ts, depth@light_arg@);
?shadow   return vec4<f32>(surface.uv, surface.height, surface.shadow);
!shadow   return vec4<f32>(surface.uv, surface.height, 1.0);
}`,
    [library]);
?map const normalAt = wgslFn(
?map     `fn relief_normal_node(@normal_params@hit_uv: vec2<f32>, depth: f32) -> vec3<f32> {
?map   return relief_normal(@normal_args@hit_uv, depth);
?map }`,
?map     [library]);

/**
 * What a material shows of the relief.
?map  * @param {{relief: THREE.Texture, extra?: THREE.Texture}} maps
!map  * @param {{}} maps none: the technique reads no map
 * @param {{tiles?: number, depth?: number, lightTs?: Node}} options lightTs: unit, towards the light, in tangent space
 */
export function reliefNodes(maps, {tiles = 1, depth = @depth@, lightTs = vec3(0, 0, 1)} = {}) {
  const hit = trace({
?map     relief_map: texture(maps.relief),
?extra     extra_map: texture(maps.extra),
?sampler     relief_sampler: sampler(maps.relief),
    plane_uv: uv().mul(tiles),
    view_ts: parallaxDirection.negate(),
    depth: float(depth),
    light_ts: lightTs,
  }).toVar();
?map   const normalTs = normalAt({
?map     relief_map: texture(maps.relief),
?map     relief_sampler: sampler(maps.relief),
?map     hit_uv: hit.xy,
?map     depth: float(depth),
?map   });
!map   const normalTs = vec3(0, 0, 1);
  return {uv: hit.xy, height: hit.z, shadow: hit.w, normalTs, normalNode: TBNViewMatrix.mul(normalTs).normalize()};
}
