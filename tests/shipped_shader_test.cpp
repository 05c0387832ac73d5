// The shader that ships compiles and traces as the technique does.
#include "reports/export/shipped_shader.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "kernels/trace/surface.h"
#include "tests/export_rig.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ShippedShader, compiles_in_both_dialects_with_no_more_than_it_needs) {
  for (const std::string& id : shipped_settings())
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      SCOPED_TRACE(id);
      const ShippedCase shipped(id, wrap);
      const ShippedText text = find_language("glsl").write(shipped.shader());
      EXPECT_THAT(text.library, HasSubstr("SPDX-License-Identifier: MIT-0"));
      const std::string code = text.library.substr(text.library.find("\n\n"));
      for (const char* word : {"#include", "constant_id", "frame.", "reference_map", "layout(", " Ray ", " trace(",
                               "BINDING", "WRAP_CLAMP ?", "uniform"})
        EXPECT_THAT(code, Not(HasSubstr(word)));
      EXPECT_EQ(code.find("sampler2D relief_map") != std::string::npos, shipped.settings.technique().reads_map());
      EXPECT_EQ(code.find("sampler2D extra_map") != std::string::npos, shipped.map.textures.extra.has_value());
      EXPECT_THAT(text.example, HasSubstr(code));
      for (const Dialect dialect : {Dialect::vulkan, Dialect::opengl})
        EXPECT_NO_THROW((void)compile_whole_fragment({.name = id, .text = text.example}, dialect)) << text.example;
    }
}

TEST(ShippedShader, everything_in_it_has_its_prefix) {
  for (const std::string& id : shipped_techniques())
    for (const MapArguments arguments : {MapArguments::combined, MapArguments::separate})
      for (const Piece& piece : shipped_source(ShippedCase(id).shader(), arguments))
        for (const std::string& name : piece.names)
          EXPECT_TRUE(!piece.is_needed || prefixed_name(name) == name) << name;
}

TEST(ShippedShader, says_on_top_what_it_is_and_how_it_is_called) {
  const ShippedCase shipped("cone?lod=footprint&format=rgba8", Wrap::clamp);
  const std::string shader = find_language("glsl").write(shipped.shader()).library;
  for (const std::string words :
       {"[DUM06] Dummer: Cone Step Mapping", "cone?cone_steps=32&", "wrap clamp",
        "relief_map: relief, 32 x 32, 6 levels, R8G8B8A8_UNORM: r = height",
        "Guarantee: never_skips, on a sampler that is off by no more than its steps make up for", "discard",
        "takes derivatives of uv", "- view_ts: from the eye"})
    EXPECT_THAT(shader.substr(0, shader.find("\n\n")), HasSubstr(words));
  EXPECT_THAT(shader, HasSubstr("ReliefWay(ray, relief_pixel_of(relief_map, uv, length(view_ts)));"));
  EXPECT_THAT(shader, Not(HasSubstr("shadow")));
}

TEST(ShippedShader, has_the_shadow_that_its_setting_has) {
  const std::string shader =
      find_language("glsl").write(ShippedCase("cone?shadow=cone&shadow_steps=24").shader()).library;
  for (const std::string words : {"of shadow", "rays: never_skips.", "const vec3 light_ts, const float light_radius)",
                                  "float shadow;  // share", "const int RELIEF_SHADOW_STEPS = 24;"})
    EXPECT_THAT(shader, HasSubstr(words));
  EXPECT_THAT(shader, Not(HasSubstr("shade_shadow")));
  for (const char* absent : {"Way", "Pixel", "begin_lod", "fade", "normal_texel"})
    EXPECT_THAT(shader, Not(HasSubstr(absent)));
}

TEST(ShippedShader, has_the_levels_and_the_fading_that_its_setting_has) {
  const std::string shader =
      find_language("glsl").write(ShippedCase("relief?lod=mean&fade=distance&fade_distance=12").shader()).library;
  for (const std::string words :
       {"relief_begin_lod(", "relief_begin_fade(way)", "const int RELIEF_FADE_DISTANCE = 12;"})
    EXPECT_THAT(shader, HasSubstr(words));
  EXPECT_THAT(shader, Not(HasSubstr("shadow")));
}

TEST(ShippedShader, is_told_where_a_ray_begins) {
  const std::string dithered = find_language("glsl").write(ShippedCase("relief?dither=temporal").shader()).example;
  for (const std::string words :
       {"- dither_phase: where in its first step", "0 to 7 time and again", "float relief_dither(ivec2 pixel",
        "relief_trace(sampler2D relief_map, const float dither_phase, const vec2 uv",
        "layout(location = 4) flat in int in_frame;",
        "relief_trace(bound_relief_map, relief_dither(ivec2(gl_FragCoord.xy), in_frame), in_uv"})
    EXPECT_THAT(dithered, HasSubstr(words));
  const std::string still = find_language("glsl").write(ShippedCase("relief?dither=pixel").shader()).example;
  EXPECT_THAT(still, HasSubstr("relief_dither(ivec2(gl_FragCoord.xy), 0), in_uv"));
  EXPECT_THAT(still, Not(HasSubstr("in_frame")));
  EXPECT_THAT(find_language("glsl").write(ShippedCase("relief").shader()).example, Not(HasSubstr("dither")));
}

TEST(ShippedShader, is_told_how_a_surface_bends) {
  const std::string bent = find_language("glsl").write(ShippedCase("cone?silhouette=quadric").shader()).example;
  for (const std::string words :
       {"- curvature: of the surface there", "of the bent ray", "[RTM] Advanced Mapping", "const vec3 curvature)",
        "layout(location = 3) in vec3 in_curvature;", "if (surface.passes) discard;", "relief_unbend(ray, hit);"})
    EXPECT_THAT(bent, HasSubstr(words));
  for (const char* absent : {"quadric_distance", "BENT_", "RAY_", "is_beside"})
    EXPECT_THAT(bent, Not(HasSubstr(absent)));
  const std::string clipped =
      find_language("glsl").write(ShippedCase("cone?silhouette=clip", Wrap::clamp).shader()).example;
  EXPECT_THAT(clipped, HasSubstr("bool passes = relief_is_beside(ray.uv + ray.slope * hit.t);"));
  for (const char* absent : {"curvature", "bend"}) EXPECT_THAT(clipped, Not(HasSubstr(absent)));
}

TEST(ShippedShader, long_lines_are_broken) {
  const std::string text = with_short_lines("float f(" + std::string(70, 'a') + ", " + std::string(70, 'b') + ");\n");
  EXPECT_EQ(text, "float f(" + std::string(70, 'a') + ",\n    " + std::string(70, 'b') + ");\n");
}

class ShippedShaderOnDevice : public BackendTest {};

TEST_P(ShippedShaderOnDevice, finds_the_techniques_hits_to_the_bit) {
  on_every_device([&](const Rig& rig) {
    for (const std::string& id : shipped_settings())
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        SCOPED_TRACE(id);
        const ShippedCase shipped(id, wrap);
        if (reads_what_no_score_frame_tells(shipped.settings)) continue;
        const ScoreFrame expected = suite_frame(rig, shipped);
        const FrameUniforms frame = frame_uniforms(shipped_scene(wrap), small_fbm().width, small_fbm().height);
        const Spirv fragment =
            compile_whole_fragment({.name = id, .text = rays_shader(shipped, frame)}, rig.row.dialect);
        const ScoreFrame found = frame_of_rays(rig, shipped, fragment, expected.pixels);
        ASSERT_EQ(found.pixels.size(), expected.pixels.size());
        int differing = 0;
        int traced = 0;
        for (std::size_t i = 0; i < found.pixels.size(); ++i) {
          if (static_cast<PixelStatus>(expected.pixels[i].status) == PixelStatus::no_ray) continue;
          ++traced;
          differing += std::memcmp(&found.pixels[i], &expected.pixels[i], sizeof(ScorePixel)) == 0 ? 0 : 1;
          differing += expected.values.empty() || found.values.front()[i] == expected.values.front()[i] ? 0 : 1;
        }
        EXPECT_GT(traced, 100);
        EXPECT_EQ(differing, 0) << "of " << traced;
      }
  });
}

// uv that are whole multiples of 2^-10 are so 1024 tiles away, too: there is no other tile than the measured one.
TEST_P(ShippedShaderOnDevice, finds_the_same_hits_far_away) {
  on_every_device([&](const Rig& rig) {
    for (const char* id :
         {"relief", "cone", "cone?filter=manual", "qdm", "omni?lookup=published", "flat", "cone?lod=footprint",
          "relief?shadow=linear", "interval?search=cone&shadow=soft_cone", "relief?silhouette=quadric_exact"}) {
      SCOPED_TRACE(id);
      const ShippedCase shipped(id);
      const std::vector<ScorePixel> rays = suite_frame(rig, shipped).pixels;
      const auto frame = [&](int tiles) {
        return frame_of_rays(rig, shipped,
                             compile_whole_fragment({.name = id, .text = far_shader(shipped, tiles)}, rig.row.dialect),
                             rays);
      };
      expect_same_surfaces(frame(0), frame(1024), rays);
      expect_same_surfaces(frame(0), frame(-3), rays);
    }
  });
}

// 2^18 tiles away a float tells 32nds of a tile: a texel to either side is lost there.
TEST_P(ShippedShaderOnDevice, has_the_same_normals_far_away) {
  on_every_device([&](const Rig& rig) {
    const ShippedCase shipped("cone");
    const std::vector<ScorePixel> rays = suite_frame(rig, shipped).pixels;
    const auto normals = [&](int tiles) {
      return frame_of_rays(
                 rig, shipped,
                 compile_whole_fragment({.name = "normal", .text = normal_shader(shipped, tiles)}, rig.row.dialect),
                 rays)
          .pixels;
    };
    const std::vector<ScorePixel> near = normals(0);
    const std::vector<ScorePixel> far = normals(1 << 18);
    int tilted = 0;
    for (std::size_t i = 0; i < near.size(); ++i) {
      tilted += near[i].ray.u != 0 || near[i].ray.v != 0 ? 1 : 0;
      EXPECT_EQ(std::memcmp(&near[i], &far[i], sizeof(ScorePixel)), 0) << i;
    }
    EXPECT_GT(tilted, 100);
  });
}

TEST(ShippedShader, drops_whole_tiles_where_there_are_any) {
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
    for (const Language& language : languages()) {
      if (language.library_file.empty()) continue;
      const std::string text = language.write(ShippedCase("relief", wrap).shader()).library;
      EXPECT_EQ(text.find("tiles = floor(") != std::string::npos, wrap == Wrap::repeat) << language.id << "\n" << text;
    }
}

/// On a cylinder, whose tangents have the length of the unit square's sides and whose curvature is the same everywhere.
Scene cylinder_scene(Wrap wrap) {
  Scene scene = shipped_scene(wrap);
  scene.view = {.id = "round", .elevation_deg = 30, .distance = 2, .fov_deg = 40};
  scene.surface = {.kind = SurfaceKind::cylinder, .round = 3};
  scene.relief_depth = 0.125;  // by which slopes are divided without rounding
  return scene;
}

/// A whole fragment shader: relief_trace() on a cylinder, into a score frame whose steps are heights.
std::string cylinder_shader(const ShippedCase& shipped, const Scene& scene) {
  const Pieces source = shipped_source(shipped.shader(), MapArguments::combined);
  const float radius = frame_uniforms(scene, small_fbm().width, small_fbm().height).surface[1];
  return rays_head(source) +
         fmt::format(R"(
void main() {{
  out_ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  vec2 along = out_ray.zw / {0:#};
  ReliefSurface surface = relief_trace({1}out_ray.xy, vec3(along, -1.0), {0:#}{2});
  float t = surface.depth_offset / {0:#} * inversesqrt(1.0 + dot(along, along));
  out_hit = vec4(t, surface.passes ? {3}.0 : surface.hit ? {4}.0 : {5}.0, float(surface.taps), surface.height);
}}
)",
                     scene.relief_depth, called_with(source, "relief_trace"),
                     takes_curvature(shipped.settings) ? fmt::format(", vec3(1.0 / {:#.9}, 0.0, 0.0)", radius) : "",
                     static_cast<int>(PixelStatus::passed), static_cast<int>(PixelStatus::hit),
                     static_cast<int>(PixelStatus::step_cap));
}

// Told the curvature that a cylinder has, what ships bends its rays as the suite does, which knows the surface; where
// they leave it, it says so.
TEST_P(ShippedShaderOnDevice, follows_a_curved_surface) {
  on_every_device([&](const Rig& rig) {
    for (const auto& [id, wrap] :
         {std::pair("cone?silhouette=quadric", Wrap::repeat), std::pair("max_mip?silhouette=quadric", Wrap::clamp),
          std::pair("relief?silhouette=quadric_exact", Wrap::repeat),
          std::pair("relief?silhouette=clip", Wrap::clamp)}) {
      SCOPED_TRACE(id);
      const ShippedCase shipped(id, wrap);
      const Scene scene = cylinder_scene(wrap);
      const std::vector<ScorePixel> expected = trace_frame(rig, shipped.settings, shipped.map, scene, kShippedSampler);
      const Spirv fragment =
          compile_whole_fragment({.name = id, .text = cylinder_shader(shipped, scene)}, rig.row.dialect);
      const ScoreFrame found = frame_of_rays(rig, shipped, fragment, expected);
      const FrameUniforms frame = frame_uniforms(scene, small_fbm().width, small_fbm().height);
      const SurfaceShape shape(frame);
      int differing = 0;
      int traced = 0;
      int passed = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const ScorePixel& pixel = expected[i];
        if (pixel.status == static_cast<float>(PixelStatus::no_ray)) continue;
        ++traced;
        passed += pixel.status == static_cast<float>(PixelStatus::passed) ? 1 : 0;
        const ScorePixel& shown = found.pixels[i];
        differing += std::abs(shown.t - pixel.t) <= 1e-4F * pixel.t && shown.status == pixel.status ? 0 : 1;
        if (!shipped.settings.is("silhouette", "quadric") || shown.status != static_cast<float>(PixelStatus::hit))
          continue;
        const auto width = static_cast<std::size_t>(scene.width_px);
        const SurfaceRay ray =
            surface_ray(frame, shape, wrap, static_cast<int>(i % width), static_cast<int>(i / width));
        EXPECT_NEAR(shown.steps, 1 - shown.t + ray.bend * shown.t * shown.t, 1e-3 * (1 + std::abs(ray.bend)));
      }
      EXPECT_GT(traced, 100);
      EXPECT_GT(passed, 10);
      EXPECT_LE(differing, traced / 50) << "of " << traced;
    }
  });
}

/// relief_trace() on rays that a texture holds, given where they meet the polygon; steps are offsets of the depth.
std::string based_shader(const ShippedShader& shipped, const Scene& scene) {
  const Pieces source = shipped_source(shipped, MapArguments::combined);
  return rays_head(source) + fmt::format(R"(
void main() {{
  out_ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  vec3 view = vec3(out_ray.zw / {0:#}, -1.0);
  ReliefSurface surface = relief_trace({1}out_ray.xy + {2:#} * out_ray.zw, view, {0:#});
  out_hit = vec4(1.0 - surface.height, surface.hit ? {3}.0 : {4}.0, float(surface.taps),
                 surface.depth_offset * inversesqrt(dot(view, view)) / {0:#});
}}
)",
                                         scene.relief_depth, called_with(source, "relief_trace"), 1 - scene.base,
                                         static_cast<int>(PixelStatus::hit), static_cast<int>(PixelStatus::step_cap));
}

// Given the polygon's uv, what ships finds the suite's hits, and their depth from the polygon on.
TEST_P(ShippedShaderOnDevice, has_the_polygon_where_its_base_is) {
  on_every_device([&](const Rig& rig) {
    for (const char* id : {"cone", "relief"})
      for (const double base : {0.0, 0.75}) {
        const ShippedCase shipped(id);
        Scene scene = shipped_scene(Wrap::repeat);
        scene.relief_depth = 0.125;  // by which slopes are divided without rounding
        scene.base = base;
        ShippedShader shader = shipped.shader();
        shader.base = base;
        const std::vector<ScorePixel> expected =
            trace_frame(rig, shipped.settings, shipped.map, scene, kShippedSampler);
        const Spirv fragment =
            compile_whole_fragment({.name = id, .text = based_shader(shader, scene)}, rig.row.dialect);
        const ScoreFrame found = frame_of_rays(rig, shipped, fragment, expected);
        int differing = 0;
        int traced = 0;
        for (std::size_t i = 0; i < expected.size(); ++i) {
          if (static_cast<PixelStatus>(expected[i].status) == PixelStatus::no_ray) continue;
          ++traced;
          const ScorePixel& shown = found.pixels[i];
          differing += std::abs(shown.t - expected[i].t) <= 1e-4F && shown.status == expected[i].status ? 0 : 1;
          EXPECT_NEAR(shown.steps, shown.t - static_cast<float>(1 - base), 1e-4) << id << " at base " << base;
        }
        EXPECT_GT(traced, 100);
        EXPECT_LE(differing, traced / 50) << id << " at base " << base << ", of " << traced;
      }
  });
}

TEST(ShippedShader, says_where_its_plane_is) {
  const ShippedCase of("cone?depth=write");
  ShippedShader shipped = of.shader();
  shipped.base = 0.25;
  const std::string text = find_language("glsl").write(shipped).example;
  for (const char* words : {"ray.uv -= 0.75 * ray.slope;", "(hit.t - 0.75) * relief_depth",
                            "vec2(eye_depth.x - 0.75 * eye_depth.y, eye_depth.y)", "The plane lies at the"})
    EXPECT_THAT(text, HasSubstr(words));
}

INSTANTIATE_TEST_SUITE_P(backends, ShippedShaderOnDevice, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
