// SPDX-License-Identifier: MIT-0
#ifndef RELIEF_UNITY_INCLUDED
#define RELIEF_UNITY_INCLUDED
#include "ReliefTrace.hlsl"

// Shader Graph, Custom Function node "Relief".
// ViewDirection: from the surface to the eye, in tangent space
void Relief_float(
?map     UnityTexture2D ReliefMap,
?extra     UnityTexture2D ExtraMap,
    float2 UV, float3 ViewDirection, float Depth,
?shadow     float3 LightTS,
    out float2 HitUV, out float Height, out float Hit, out float DepthOffset,
?shadow     out float Shadow,
    out float3 NormalTS) {
  ReliefSurface surface = relief_trace(@args@UV, -ViewDirection, Depth@light_arg@);
  HitUV = surface.uv;
  Height = surface.height;
  Hit = surface.hit ? 1.0 : 0.0;
  DepthOffset = surface.depth_offset;
?shadow   Shadow = surface.shadow;
?map   NormalTS = relief_normal(@normal_args@surface.uv, Depth);
!map   NormalTS = float3(0.0, 0.0, 1.0);
}
#endif
