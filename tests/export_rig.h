#pragma once
#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "kernels/image/heightmap.h"
#include "reports/export/language.h"
#include "tests/technique_rig.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {

/// The techniques that one function traces: those of several passes are not exported.
inline std::vector<std::string> shipped_techniques() {
  std::vector<std::string> ids;
  for (const Technique& technique : techniques())
    if (technique.passes.empty()) ids.emplace_back(technique.id);
  return ids;
}

/// All of them, and what changes which code or textures they need.
inline std::vector<std::string> shipped_settings() {
  std::vector<std::string> ids = shipped_techniques();
  for (const char* id : {"parallax?variant=plain&filter=manual",
                         "relief?refinement=none&loop=fixed&filter=manual",
                         "relief?refinement=secant&format=r32f",
                         "depth_slices?loop=fixed",
                         "interval?search=cone&format=rg16f",
                         "cone?step=plain&format=rgba8",
                         "cone?correction=min4&step=cell_max&format=r8+r8",
                         "cone?correction=min4&filter=manual&encoding=h_tan",
                         "cone?lod=footprint&encoding=atan",
                         "relief?lod=mean&fade=footprint&shadow=linear",
                         "flat?normals=footprint",
                         "relaxed_cone?refinement=secant&format=r8+r8&encoding=ratio",
                         "quad_cone?refinement=binary&filter=manual",
                         "safety_shape?loop=fixed&format=r8+rgba8",
                         "qdm?refinement=none",
                         "qdm?refinement=binary&filter=manual",
                         "distance?step=published",
                         "omni?interpolation=none&omni_order=xyab&omni_directions=spherical",
                         "omni?lookup=published&filter=manual",
                         "relief?dither=temporal",
                         "interval?dither=pixel&filter=manual",
                         "relief?shadow=linear",
                         "relief?shadow=binary",
                         "cone?shadow=cone&format=rgba8",
                         "cell_cone?shadow=cell",
                         "relaxed_cone?shadow=soft_taps&shadow_bias=1_256",
                         "interval?search=cone&shadow=soft_cone",
                         "cone?silhouette=quadric&lod=footprint&shadow=cone",
                         "relief?silhouette=quadric_exact",
                         "relief?silhouette=clip"})
    ids.emplace_back(id);
  return ids;
}

/// A setting that ships, with its map.
struct ShippedCase {
  explicit ShippedCase(const std::string& id, Wrap its_wrap = Wrap::repeat)
      : settings(parse_setting(id)), wrap(its_wrap), map(store_map(settings, small_fbm(), wrap)) {}
  [[nodiscard]] ShippedShader shader() const {
    ShippedShader shipped{.settings = settings, .heightmap = "fbm", .wrap = wrap};
    if (settings.technique().reads_map()) shipped.textures = shipped_textures(settings, map.textures);
    return shipped;
  }
  Settings settings;
  Wrap wrap;
  StoredMap map;
};

/// The view's angle, the pixel's size, or how the surface bends.
inline bool reads_what_no_score_frame_tells(const Settings& settings) {
  return settings.technique().id == "parallax" || takes_derivatives(settings) || takes_curvature(settings);
}

/// `relief_map, extra_map, `, as a function takes them.
inline std::string called_with(const Pieces& source, const std::string& function) {
  std::string list;
  for (const std::string& map : map_arguments(source, function))
    list += map == kDitherPhase ? "relief_dither(ivec2(gl_FragCoord.xy), 0), " : map + ", ";
  return list;
}

/// What a whole fragment shader has round a main() that traces rays that a texture holds into a score frame.
inline std::string rays_head(const Pieces& source) {
  return "#version 450\n" + with_short_lines(text_of(source)) + R"(
#ifdef VULKAN
#define PLACE(n) set = 0, binding = n
#else
#define PLACE(n) binding = n
#endif
layout(PLACE(1)) uniform sampler2D relief_map;
layout(PLACE(3)) uniform sampler2D rays;
layout(PLACE(4)) uniform sampler2D extra_map;
layout(location = 0) out vec4 out_ray;
layout(location = 1) out vec4 out_hit;
)";
}

/// The shipped trace on such rays.
inline std::string rays_shader(const ShippedCase& shipped, const FrameUniforms& frame) {
  const Pieces source = shipped_source(shipped.shader(), MapArguments::combined);
  const bool has_shadow = has_value_of(shipped.settings, Query::shadow);
  std::string text = rays_head(source);
  if (has_shadow) text += "layout(location = 2) out float out_shadow;\n";
  text += fmt::format(R"(
void main() {{
  out_ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  ReliefRay ray = ReliefRay(out_ray.xy, out_ray.zw, 1.0, 0, 1.0);
  ReliefHit hit = relief_first_hit({}ray);
)",
                      called_with(source, "relief_first_hit"));
  if (has_shadow)
    text += fmt::format(
        "  out_shadow = relief_shadow({}ray, ReliefScene(vec3({:#.9}, {:#.9}, {:#.9}), {:#.9}, 0.1, vec2(0.0), "
        "vec2(0.0)), hit);\n",
        called_with(source, "relief_shadow"), frame.light[0], frame.light[1], frame.light[2], frame.light[3]);
  return text + "  out_hit = vec4(hit.t, float(hit.status), float(hit.taps), float(hit.steps));\n}\n";
}

/// relief_trace() of rays that a texture holds, `tiles` tiles to the right and up, on uv that are whole there; what it
/// finds, with uv from there, in place of rays and hits.
inline std::string far_shader(const ShippedCase& shipped, int tiles) {
  const Pieces source = shipped_source(shipped.shader(), MapArguments::combined);
  const bool has_shadow = has_value_of(shipped.settings, Query::shadow);
  return rays_head(source) + fmt::format(R"({0}
void main() {{
  vec4 ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  vec2 tiles = vec2({1:#}, {2:#});
  vec2 uv = floor(ray.xy * 1024.0) / 1024.0 + tiles;
  ReliefSurface surface = relief_trace({3}uv, vec3(ray.zw, -1.0), 1.0{4}{5});
  out_ray = vec4(surface.uv - tiles, surface.height, surface.depth_offset);
  out_hit = vec4(surface.height, surface.hit ? 1.0 : 0.0, float(surface.taps), 0.0);
{6}}}
)",
                                         has_shadow ? "layout(location = 2) out float out_shadow;\n" : "",
                                         static_cast<double>(tiles), static_cast<double>(-tiles),
                                         called_with(source, "relief_trace"),
                                         takes_curvature(shipped.settings) ? ", vec3(0.125, 0.0, 0.0)" : "",
                                         has_shadow ? ", vec3(0.6, 0.0, 0.8), 0.0625" : "",
                                         has_shadow ? "  out_shadow = surface.shadow;\n" : "");
}

/// relief_normal() in place of rays, on uv of whole 32nds that are `tiles` tiles away.
inline std::string normal_shader(const ShippedCase& shipped, int tiles) {
  const Pieces source = shipped_source(shipped.shader(), MapArguments::combined);
  return rays_head(source) + fmt::format(R"(
void main() {{
  vec2 uv = floor(texelFetch(rays, ivec2(gl_FragCoord.xy), 0).xy * 32.0) / 32.0 + {:#};
  out_ray = vec4(relief_normal({}uv, 1.0), 0.0);
  out_hit = vec4(0.0);
}}
)",
                                         static_cast<double>(tiles), called_with(source, "relief_normal"));
}

/// A score frame with what its features found.
struct ScoreFrame {
  std::vector<ScorePixel> pixels;
  FeatureValues values;
};

/// That two frames of far_shader() are the same to the bit, but for uv, which are rounded where they are large.
inline void expect_same_surfaces(const ScoreFrame& near, const ScoreFrame& far, const std::vector<ScorePixel>& rays) {
  int traced = 0;
  int differing = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (static_cast<PixelStatus>(rays[i].status) == PixelStatus::no_ray) continue;
    ++traced;
    const ScorePixel& a = near.pixels[i];
    const ScorePixel& b = far.pixels[i];
    differing += a.ray.slope_u == b.ray.slope_u && a.ray.slope_v == b.ray.slope_v && a.t == b.t &&
                         a.status == b.status && a.taps == b.taps &&
                         (near.values.empty() || near.values.front()[i] == far.values.front()[i])
                     ? 0
                     : 1;
    EXPECT_NEAR(a.ray.u, b.ray.u, 0x1p-13);
    EXPECT_NEAR(a.ray.v, b.ray.v, 0x1p-13);
  }
  EXPECT_GT(traced, 100);
  EXPECT_EQ(differing, 0) << "of " << traced;
}

/// The scene of the export's tests: a light that throws shadows.
inline Scene shipped_scene(Wrap wrap) {
  Scene scene = kScene;
  scene.wrap = wrap;
  scene.light = {.elevation_deg = 20, .angular_radius_deg = 3};
  return scene;
}

inline ScoreFrame suite_frame(const Rig& rig, const ShippedCase& shipped) {
  ScoreFrame frame;
  frame.pixels = trace_frame(rig, shipped.settings, shipped.map, shipped_scene(shipped.wrap), kShippedSampler);
  frame.values = rig.backend->read_values(pixel_features(shipped.settings));
  return frame;
}

/// The frame of a shader that traces the rays of another one (rays_shader, or what was made from it).
inline ScoreFrame frame_of_rays(const Rig& rig, const ShippedCase& shipped, const Spirv& fragment,
                                const std::vector<ScorePixel>& rays) {
  const Scene scene = shipped_scene(shipped.wrap);
  const std::vector<PixelFeature> features = pixel_features(shipped.settings);
  std::vector<std::array<float, 4>> texels;
  for (const ScorePixel& pixel : rays)
    texels.push_back({pixel.ray.u, pixel.ray.v, pixel.ray.slope_u, pixel.ray.slope_v});
  const auto ray_texture = rig.backend->upload({.width = scene.width_px,
                                                .height = scene.height_px,
                                                .layout = {.type = TexelType::float32, .channels = 4},
                                                .texels = std::as_bytes(std::span(texels)),
                                                .wrap = Wrap::clamp,
                                                .filter = Filter::nearest});
  const auto pipeline = rig.pipeline(fragment, score_target(features), {}, "shipped");
  const auto relief = rig.backend->upload(texture_desc(shipped.map.textures.relief, shipped.wrap));
  const auto& extra_image = shipped.map.textures.extra;
  const auto extra = extra_image ? rig.backend->upload(texture_desc(*extra_image, shipped.wrap)) : nullptr;
  Textures textures = rig.textures(relief.get(), extra.get());
  textures["rays"] = ray_texture.get();
  rig.backend->render({.pipeline = pipeline.get(),
                       .textures = std::move(textures),
                       .frame = frame_uniforms(scene, small_fbm().width, small_fbm().height)},
                      1, Timer::fenced_wall);
  ScoreFrame frame;
  frame.pixels = rig.backend->read_score();
  frame.values = rig.backend->read_values(features);
  return frame;
}

}  // namespace reliefbench
