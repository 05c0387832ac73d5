// Relief mapping with one light, for the Universal Render Pipeline. SPDX-License-Identifier: MIT-0
Shader "Relief/URP" {
  Properties {
?map     [NoScaleOffset] _ReliefMap("Relief map (@relief_file@)", 2D) = "white" {}
?extra     [NoScaleOffset] _ExtraMap("Extra map (@extra_file@)", 2D) = "white" {}
    [MainTexture] _BaseMap("Colour", 2D) = "white" {}
    _Tiles("Tiles", Float) = 1
    _Depth("Depth, in sides of a tile", Float) = @depth@
  }
  SubShader {
    Tags { "RenderPipeline" = "UniversalPipeline" "RenderType" = "Opaque" }
    Pass {
      Tags { "LightMode" = "UniversalForward" }
      HLSLPROGRAM
      #pragma target 5.0
      #pragma vertex vertex
      #pragma fragment fragment
      #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
      #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Lighting.hlsl"
      #include "ReliefTrace.hlsl"

?map       TEXTURE2D(_ReliefMap);
?map       SAMPLER(sampler_ReliefMap);
?extra       TEXTURE2D(_ExtraMap);
?extra       SAMPLER(sampler_ExtraMap);
      TEXTURE2D(_BaseMap);
      SAMPLER(sampler_BaseMap);
      CBUFFER_START(UnityPerMaterial)
      float _Tiles;
      float _Depth;
      CBUFFER_END

      struct Attributes {
        float4 position : POSITION;
        float3 normal : NORMAL;
        float4 tangent : TANGENT;
        float2 uv : TEXCOORD0;
      };
      struct Varyings {
        float4 position : SV_POSITION;
        float2 uv : TEXCOORD0;
        float3 world : TEXCOORD1;
        float3 normal : TEXCOORD2;
        float4 tangent : TEXCOORD3;
      };

      Varyings vertex(Attributes input) {
        VertexPositionInputs place = GetVertexPositionInputs(input.position.xyz);
        VertexNormalInputs frame = GetVertexNormalInputs(input.normal, input.tangent);
        Varyings output;
        output.position = place.positionCS;
        output.uv = input.uv * _Tiles;
        output.world = place.positionWS;
        output.normal = frame.normalWS;
        output.tangent = float4(frame.tangentWS, input.tangent.w * GetOddNegativeScale());
        return output;
      }

      float4 fragment(Varyings input) : SV_Target {
        float3 bitangent = cross(input.normal, input.tangent.xyz) * input.tangent.w;
        float3x3 frame = float3x3(normalize(input.tangent.xyz), normalize(bitangent), normalize(input.normal));
        float3 view_ts = mul(frame, input.world - GetCameraPositionWS());
        Light light = GetMainLight();
        float3 light_ts = normalize(mul(frame, light.direction));
        ReliefSurface surface = relief_trace(@args@input.uv, view_ts, _Depth@light_arg@);
?map         float3 normal_ts = relief_normal(@normal_args@surface.uv, _Depth);
!map         float3 normal_ts = float3(0.0, 0.0, 1.0);
        float diffuse = saturate(dot(normal_ts, light_ts));
?shadow         diffuse *= surface.shadow;
        float3 colour = SAMPLE_TEXTURE2D_GRAD(_BaseMap, sampler_BaseMap, surface.uv, ddx(input.uv), ddy(input.uv)).rgb;
?clamp         clip(float4(input.uv, 1.0 - input.uv));
        return float4(colour * (0.2 + diffuse * light.color), 1.0);
      }
      ENDHLSL
    }
  }
}
