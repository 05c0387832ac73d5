#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "kernels/judge/light.h"
#include "kernels/judge/score.h"
#include "kernels/trace/depth.h"
#include "kernels/trace/feature.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/surface_tracer.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"

namespace reliefbench {

namespace {

Param shadow_steps() {
  return range_param("shadow_steps", "most looks at the map on the way to the light", 1, 4096, 16);
}
Param shadow_bias() {
  return choice_param("shadow_bias", "how far over the hit the way to the light begins, in heights",
                      {"none", "1_1024", "1_256", "1_64"}, "none");
}

std::string lacks_cones(const Settings& settings) {
  const MapRow& map = map_of(settings);
  if (map.ratios == 1 && !map.is_of_cells) return "";
  return fmt::format("shadow={} needs a map with one cone a texel, which {} is not", settings.choice("shadow"), map.id);
}
std::string lacks_cells(const Settings& settings) {
  const MapRow& map = map_of(settings);
  return map.is_of_cells ? "" : fmt::format("shadow=cell needs a map with a cone a cell, which {} is not", map.id);
}

LightSource light_of(const FrameUniforms& frame) {
  const auto [x, y, z, radius] = frame.light;
  return {.direction = {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)},
          .radius = static_cast<double>(radius),
          .relief_depth = static_cast<double>(frame.position[3])};
}

std::vector<float> exact_shadow(const ReferenceTracer& tracer, const FrameUniforms& frame,
                                std::span<const TextureRay> rays, std::span<const ReferenceHit> hits) {
  if (is_curved(frame.surface_kind())) return exact_light(tracer, light_of(frame), frame, hits);
  return exact_light(tracer, light_of(frame), rays, hits);
}

std::int64_t broken_shadows(const ReferenceTracer& tracer, const FrameUniforms& frame,
                            std::span<const ScorePixel> pixels, std::span<const float> found) {
  if (is_curved(frame.surface_kind())) return 0;  // promised of planes alone
  return falsely_lit(tracer, light_of(frame), frame.sizes[2], frame.sizes[3], pixels, found);
}

std::string lacks_normals(const Settings& settings) {
  if (settings.technique().reads_map() && storage_of(settings).format.with_normal)
    return fmt::format("normals={} needs normals apart from the map, which format={} has in it",
                       settings.choice("normals"), settings.choice("format"));
  return "";
}

std::string lacks_edge(const Scene& scene) {
  return scene.wrap == Wrap::clamp ? "" : "silhouette=clip needs wrap=clamp: a surface that closes has no edge";
}

/// What goes wrong with rays that are bent.
std::string lacks_straight(const Settings& settings) {
  const std::string_view row = settings.choice("silhouette");
  const Technique& technique = settings.technique();
  if (!technique.passes.empty())
    return fmt::format("silhouette={} needs another technique than {}, whose planes straight rays cross", row,
                       technique.id);
  for (const std::string_view id : {"parallax", "omni"})
    if (technique.id == id)
      return fmt::format("silhouette={} needs a technique that goes along the ray, which {} does not", row, id);
  for (const std::string_view id : {"fade", "over_relaxation"})
    if (settings.active(id) != nullptr && settings.get(id) != 0)
      return fmt::format("silhouette={} bends rays, and {}={} counts on straight ones", row, id, settings.choice(id));
  return "";
}

/// The published distance is no parabola, which cones, cells and pyramids count on.
std::string lacks_march(const Settings& settings) {
  if (std::string reason = lacks_straight(settings); !reason.empty()) return reason;
  constexpr std::array<std::string_view, 2> kMarches{"relief", "depth_slices"};
  const std::string_view technique = settings.technique().id;
  if (std::ranges::find(kMarches, technique) != kMarches.end() || settings.is("search", "linear")) return "";
  return fmt::format("silhouette=quadric_exact needs a march in equal steps (relief, depth_slices, interval), not {}",
                     technique);
}

std::string lacks_draws(const Settings& settings) {
  const Technique& technique = settings.technique();
  if (!technique.passes.empty())
    return fmt::format("dispatch=compute needs another technique than {}, whose passes are draws", technique.id);
  if (settings.is("normals", "gradient"))
    return "dispatch=compute needs normals=footprint or base: derivatives are fragments' alone";
  if (settings.active("depth") != nullptr && settings.get("depth") != 0)
    return fmt::format("dispatch=compute has no depth buffer, which depth={} writes", settings.choice("depth"));
  return "";
}
std::string lacks_whole_frame(const Scene& scene) {
  return needs_depth(scene) ? "dispatch=compute needs a scene whose frames the relief fills: no mesh, nothing before it"
                            : "";
}

/// Upwards a cone must be free of all of the surface: relaxed ones are right only from the top plate.
Guarantee cone_shadow_guarantee(const Settings& settings) {
  return has_free_cones(settings) && settings.is("shadow_bias", "none") ? Guarantee::never_skips : Guarantee::none;
}

std::vector<float> exact_depths(const ReferenceTracer& tracer, const FrameUniforms& frame,
                                std::span<const TextureRay> /*rays*/, std::span<const ReferenceHit> hits) {
  return exact_depth(frame, tracer.wrap(), hits);
}
std::int64_t broken_depths(const ReferenceTracer& tracer, const FrameUniforms& frame,
                           std::span<const ScorePixel> pixels, std::span<const float> found) {
  return wrong_depths(frame, tracer.wrap(), pixels, found);
}
std::string lacks_plate(const Scene& scene) {
  if (scene.base < 1) return "depth=conservative needs base 1: the relief over the polygon is nearer than the polygon";
  if (!is_curved(scene.surface.kind)) return "";
  return fmt::format("depth=conservative needs a plane: the top plate's depth on a {} is known to fragments alone",
                     surface_row(scene.surface.kind).id);
}
/// Of the hit that was found, whatever finds it.
Guarantee depth_guarantee(const Settings& /*settings*/) { return Guarantee::exact; }

std::vector<Feature> feature_table() {
  return {
      {.id = "refinement",
       .description = "how the bracket round the hit is narrowed",
       .rows = {{.id = "none", .description = "not at all: its far end is the hit", .shader = "refinement.glsl"},
                {.id = "secant",
                 .description = "where the line through its ends meets the surface, time and again (regula falsi)",
                 .source = "[RIS05]",
                 .params = {range_param("secant_steps", "probes of the secant search before its last interpolation", 0,
                                        32, 1)},
                 .shader = "refinement.glsl"},
                {.id = "binary",
                 .description = "by halving",
                 .source = "[RTM] listing 5.3",
                 .params = {range_param("binary_steps", "halvings of the bracket", 0, 32, 6)},
                 .shader = "refinement.glsl"},
                {.id = "contact",
                 .description = "by equal steps again, inside the bracket: the first under the surface is the hit",
                 .source = "Riccardi 2019, as O3DE ships it",
                 .params = {range_param("contact_steps", "steps that the bracket is divided into", 1, 256, 16)},
                 .shader = "refinement.glsl"}}},
      {.id = "filter",
       .description = "the sampler's bilinear filter, or four fetches with full-precision weights",
       .rows = {{.id = "hardware",
                 .description = "the sampler's, whose weights have 8 bits on most devices",
                 .caveat = "on a sampler that is off by no more than its steps make up for"},
                {.id = "manual", .description = "four fetches, weighted in full precision"}},
       .constant_id = kFilterConstant,
       .is_of_all = true},
      {.id = "dispatch",
       .description = "what a frame's pixels are traced by: a fragment each, or a compute shader's invocation",
       .rows = {{.id = "fragment", .description = "fragments of a triangle over the whole frame"},
                {.id = "compute",
                 .description = "a compute shader in groups of 8x8 pixels, which puts them into an image",
                 .source = "as engines that shade in compute",
                 .lacks = lacks_draws,
                 .lacks_in = lacks_whole_frame}},
       .constant_id = kNoConstant,
       .is_spelt_out = false,
       .is_of_all = true,
       .needs_map = false},
      {.id = "shadow",
       .description = "what keeps the light from a hit: the relief's shadow on itself",
       .rows = {{.id = "none", .description = "nothing: every hit is lit"},
                {.id = "linear",
                 .description = "equal steps from the hit up to the top plate; lit unless one is under the relief",
                 .source = "[RTM] 5.3, from the hit instead of the light's entry point",
                 .params = {shadow_steps(), shadow_bias()},
                 .shader = "shadow_linear.glsl"},
                {.id = "binary",
                 .description =
                     "equal steps, then halving, from where the light comes in at the top plate; lit if that "
                     "leads to the hit, but for a threshold",
                 .source = "[RTM] listing 5.3",
                 .params = {shadow_steps(),
                            range_param("shadow_halvings", "halvings of the bracket on the light's way", 0, 32, 5),
                            choice_param("shadow_threshold", "how far before the hit it may end, in heights",
                                         {"none", "1_1024", "1_256", "1_64"}, "1_64")},
                 .shader = "shadow_binary.glsl"},
                {.id = "cone",
                 .description =
                     "upwards from cone to cone, cells solved; what its steps leave undecided is dark. Lights "
                     "nothing of a plane falsely with cones that are safe from anywhere and without a bias; relaxed "
                     "cones are right only from the top plate",
                 .source = "cones [DUM06], upwards and with solved cells ours",
                 .params = {shadow_steps(), shadow_bias()},
                 .shader = "shadow_cone.glsl",
                 .lacks = lacks_cones,
                 .guarantee_when = cone_shadow_guarantee},
                {.id = "soft_taps",
                 .description = "a few taps towards the light: what stands highest over the ray darkens, more so near "
                                "the hit. Whatever the light's size",
                 .source = "as engines ship it; the formula is ours",
                 .params = {shadow_steps(), shadow_bias()},
                 .shader = "shadow_soft_taps.glsl",
                 .also = "penumbra"},
                {.id = "soft_cone",
                 .description = "sharp where a shadow touches what casts it, wider with the distance, by the light's "
                                "size: of all looks the one that clears the relief least for its distance",
                 .source = "contact hardening as engines ship it; with cones ours",
                 .params = {shadow_steps(), shadow_bias()},
                 .shader = "shadow_soft_cone.glsl",
                 .also = "penumbra",
                 .lacks = lacks_cones},
                {.id = "cell",
                 .description = "as cone, by cones of cells: those that the ray is not wholly over are solved",
                 .source = "ours",
                 .params = {shadow_steps(), shadow_bias()},
                 .shader = "shadow_cell.glsl",
                 .lacks = lacks_cells,
                 .guarantee_when = cone_shadow_guarantee}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .ground = Ground::no_mesh,
       .value = PixelValue{.shader = "shadow.glsl",
                           .function = "relief_shadow",
                           .meaning = "share of the light that arrives at the hit, 0 to 1",
                           .output = "out_shadow",
                           .query = Query::shadow,
                           .version = kLightVersion,
                           .exact = exact_shadow,
                           .broken = broken_shadows}},
      {.id = "lod",
       .description =
           "level of the map that a ray reads, by the pixel's image on the plane; of techniques that promise "
           "never to skip the chain is conservative, so that hits lie on or before the base's, of others "
           "heights are means",
       .rows = {{.id = "base", .description = "the map itself"},
                {.id = "footprint",
                 .description = "texels up to as large as the longer side of the pixel's image",
                 .source = "GL's scale factor of an isotropic sampler",
                 .shader = "lod_footprint.glsl",
                 .caveat = "on the level that is read, whose surface lies over the base's"},
                {.id = "minimum",
                 .description = "texels up to as large as its shorter side",
                 .source = "as engines bound anisotropy",
                 .shader = "lod_minimum.glsl",
                 .caveat = "on the level that is read, whose surface lies over the base's"},
                {.id = "mean",
                 .description = "texels up to as large as the mean of its sides",
                 .source = "as engines ship it",
                 .shader = "lod_mean.glsl",
                 .caveat = "on the level that is read, whose surface lies over the base's"}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .hook = Hook::way},
      {.id = "fade",
       .description = "where the relief goes over into plain normal mapping, whose hits are free",
       .rows = {{.id = "none", .description = "nowhere"},
                {.id = "distance",
                 .description = "its depth shrinks in the second half of a distance from the eye",
                 .source = "as engines ship it",
                 .params = {range_param("fade_distance", "sides of a tile from the eye to where nothing is left", 1,
                                        4096, 8)},
                 .shader = "fade_distance.glsl",
                 .keeps_guarantee = false},
                {.id = "footprint",
                 .description = "its depth shrinks as a pixel comes to cover more texels",
                 .source = "ours",
                 .params = {range_param("fade_texels", "longer side of a pixel's image where nothing is left, texels",
                                        1, 4096, 8)},
                 .shader = "fade_footprint.glsl",
                 .keeps_guarantee = false}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .hook = Hook::way},
      {.id = "normals",
       .description = "level of the normal map that is read at the found uv",
       .rows = {{.id = "base", .description = "the map itself, which trembles far away"},
                {.id = "footprint",
                 .description = "by the longer side of the pixel's image on the plane",
                 .source = "gradients of the plane's uv, as [PO07] advises",
                 .shader = "normals_footprint.glsl",
                 .lacks = lacks_normals},
                {.id = "gradient",
                 .description = "by the derivatives of the found uv, which are large where a hit lies behind another",
                 .source = "as engines get it without care",
                 .shader = "normals_gradient.glsl",
                 .lacks = lacks_normals}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .needs_map = false,
       .hook = Hook::normal},
      {.id = "silhouette",
       .description = "how a ray ends beside the relief of a curved surface, so that its outline is seen",
       .rows = {{.id = "none", .description = "never: every ray goes on in the plane that touches where it enters"},
                {.id = "clip",
                 .description = "where its hit lies beyond the unit square",
                 .source = "[RTM] 5.4; as engines clip texture bounds",
                 .shader = "surface_frame.glsl",
                 .defines = {"CLIPPED"},
                 .lacks_in = lacks_edge},
                {.id = "quadric",
                 .description = "where it leaves the top plate, bent as a quadric of the surface's curvature: a "
                                "parabola, which is exact up to third order of the way",
                 .source = "[RTM] equation 5.3, listings 5.5 to 5.7; solved cells and safe steps on it ours",
                 .shader = "surface_bent.glsl",
                 .defines = {"BENT_RAYS", "CLIPPED"},
                 .caveat = "of the bent ray",
                 .lacks = lacks_straight},
                {.id = "quadric_exact",
                 .description = "the same, its depth measured across the ray as published: right where the ray "
                                "grazes, too deep by the sine of its angle elsewhere",
                 .source = "[RTM] equation 5.2",
                 .shader = "surface_bent.glsl",
                 .defines = {"BENT_RAYS", "BENT_EXACTLY", "CLIPPED"},
                 .keeps_guarantee = false,
                 .lacks = lacks_march}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .ground = Ground::curved,
       .hook = Hook::silhouette},
      {.id = "depth",
       .description = "what the depth buffer gets, where other objects cut through the relief",
       .rows = {{.id = "none", .description = "the top plate's depth: nothing in the shader"},
                {.id = "write",
                 .description =
                     "the hit's own, within 4 ulps of 1 and the rounding of the ray; no fragment is rejected "
                     "before it has run",
                 .source = "[RTM] 5.4, by a formula without cancellation",
                 .shader = "depth_write.glsl",
                 .guarantee_when = depth_guarantee},
                {.id = "conservative",
                 .description = "the same, declared never to be nearer than the top plate: fragments behind what was "
                                "drawn before may be rejected by that",
                 .source = "ARB_conservative_depth",
                 .shader = "depth_write.glsl",
                 .lacks_in = lacks_plate,
                 .guarantee_when = depth_guarantee},
                {.id = "rtm",
                 .description = "the hit's own by the paper's formula, which cancels at the near plane",
                 .source = "[RTM] listing 5.4",
                 .shader = "depth_rtm.glsl"}},
       .is_spelt_out = false,
       .is_of_all = true,
       .is_of_scene = true,
       .ground = Ground::no_mesh,
       .value = PixelValue{.shader = "depth_frame.glsl",
                           .function = "relief_window_depth",
                           .meaning = "what the depth buffer holds of the hit, 0 on the near plane, 1 on the far one",
                           .output = "out_depth",
                           .query = Query::depth,
                           .version = kDepthVersion,
                           .exact = exact_depths,
                           .broken = broken_depths,
                           .has_objects = true}},
  };
}

/// Gives the parameters of features of the scene their specialization constants, one an id.
std::vector<Feature> with_constants(std::vector<Feature> features) {
  std::vector<std::string_view> ids;
  for (Feature& feature : features)
    for (FeatureRow& row : feature.rows)
      for (Param& param : row.params) {
        if (!feature.is_of_scene) continue;
        const auto place = std::ranges::find(ids, param.id) - ids.begin();
        if (place == std::ssize(ids)) ids.push_back(param.id);
        param.constant_id = static_cast<int>(kFirstFeatureConstant + place);
      }
  return features;
}

}  // namespace

const std::vector<Feature>& all_features() {
  static const std::vector<Feature> table = with_constants(feature_table());
  return table;
}

}  // namespace reliefbench
