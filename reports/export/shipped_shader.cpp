#include "reports/export/shipped_shader.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "kernels/maps/sector_map.h"
#include "kernels/trace/shader_contract.h"
#include "reports/export/glsl_fold.h"
#include "reports/export/template.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// "r = height (1 = top), g = cone ratio, stored as sqrt"
std::string relief_channels(const MapStorage& storage) {
  std::string text = "r = height, 1 on top";
  if (storage.map.content == MapContent::ratios && storage.format.extra_channels == 0)
    text += fmt::format("; g = cone ratio, stored as {}", storage.encoding.id);
  if (storage.map.is_solid && storage.format.extra_channels == 0) text += "; g = height of the lower surface";
  if (storage.format.with_normal) text += "; b, a = x, y of the normal, each times 0.5 + 0.5";
  return text;
}

std::string extra_channels(const MapStorage& storage, std::span<const MapValue> parameters) {
  const std::string_view description = storage.map.description;
  if (storage.map.is_solid && storage.map.content == MapContent::ratios)
    return fmt::format("r = height of the lower surface; g, b = ratios of the cones up and down, stored as {}",
                       storage.encoding.id);
  if (storage.map.is_solid && storage.map.content == MapContent::heights) return "r = height of the lower surface";
  switch (storage.map.content) {
    case MapContent::pyramid:
      return fmt::format("{} = {}", storage.map.is_solid ? "r, g" : "r", description);
    case MapContent::volume:
      return fmt::format("r = {}; its slices in rows, the bottom one first", description);
    case MapContent::sectors:
      return fmt::format("r = height, g = cone ratio{}, stored as {}: {}; every layer within a border of one texel",
                         has_opposite_ratios(parameters) ? ", b = that of the opposite sector" : "",
                         storage.encoding.id, description);
    case MapContent::table:
      return fmt::format("r = {}, 0 on top, 1 at the bottom", description);
    default:
      return fmt::format("{}, stored as {}: {}", storage.map.ratios == 1 ? "r = cone ratio" : "cone ratios",
                         storage.encoding.id, description);
  }
}

/// What a silhouette's row says of rays.
std::set<std::string> ray_defines(const Settings& settings) {
  std::set<std::string> defines;
  for (const PixelFeature& one : frame_features(settings))
    if (one.feature->hook == Hook::silhouette) defines.insert(one.row->defines.begin(), one.row->defines.end());
  return defines;
}

/// What features make of a ray before it is traced, and the trace.
std::string way_lines(const Settings& settings) {
  if (!takes_derivatives(settings)) return "  Hit hit = trace(ray);\n";
  std::string begins;
  for (const PixelFeature& one : frame_features(settings))
    if (one.feature->hook == Hook::way) begins += fmt::format("  begin_{}(way);\n", one.feature->id);
  return fmt::format(
      "  Way way = Way(ray, pixel_of(uv, length(view_ts)));\n{}  ray = way.ray;\n  Hit hit = traced(ray);\n", begins);
}

/// When nothing of the relief is seen; "": there always is.
std::string passes_when(const ShippedShader& shipped) {
  std::string when = shipped.settings.technique().is_of_solids() ? "hit.status == STATUS_PASSED" : "";
  if (takes_curvature(shipped.settings)) when = "leaves(ray) && hit.t >= ray.end";
  if (shipped.wrap == Wrap::clamp && ray_defines(shipped.settings).contains("CLIPPED"))
    when += fmt::format("{}is_beside(ray.uv + ray.slope * hit.t)", when.empty() ? "" : " || ");
  return when;
}

/// Where a ray meets the polygon, as frame.glsl has it of the scene.
std::string polygon(double base) { return fmt::format("float polygon_t() {{ return {:#}; }}\n", 1 - base); }

/// `ReliefSurface relief_trace(...)`: what a pixel is shaded with. Its arguments are constants, so that languages take
/// them by value.
std::string entry(const ShippedShader& shipped) {
  const Settings& settings = shipped.settings;
  const std::vector<PixelFeature> features = pixel_features(settings);
  const bool is_lit = has_value_of(settings, Query::shadow);
  const bool has_depth = has_value_of(settings, Query::depth);
  const bool is_bent = takes_curvature(settings);
  const bool has_tiles = shipped.wrap == Wrap::repeat;
  const std::string passes = passes_when(shipped);
  const std::string above = shipped.base == 1 ? "" : fmt::format("{:#}", 1 - shipped.base);
  const std::string eye_depth =
      above.empty() ? "eye_depth" : fmt::format("vec2(eye_depth.x - {} * eye_depth.y, eye_depth.y)", above);
  std::string members;
  std::string values;
  if (!passes.empty()) {
    members += "  bool passes;         // true: nothing of the relief is seen, discard the fragment\n";
    values += "  surface.passes = passes;\n";
  }
  for (const PixelFeature& one : features) {
    members += fmt::format("  float {};  // {}\n", one.feature->id, one.feature->value->meaning);
    values += fmt::format("  surface.{} = {}(ray, Scene({}, relief_depth, {}), hit);\n", one.feature->id,
                          one.feature->value->function, is_lit ? "light_ts, light_radius" : "vec3(0.0), 0.0",
                          has_depth ? "planes, " + eye_depth : "vec2(0.0), vec2(0.0)");
  }
  return fmt::format(
      R"(
// What relief_trace finds.
struct ReliefSurface {{
  vec2 uv;             // of the hit, in tiles: for every other texture
  float height;        // of the hit, 1 = the highest
  bool hit;            // false: the steps were used up before{}
  float depth_offset;  // way from the plane to the hit, in sides of a tile
  int taps;            // texture instructions
{}}};

// The surface that a fragment shows. The file's head says what the arguments are.
ReliefSurface relief_trace(const vec2 uv, const vec3 view_ts, const float relief_depth{}{}{}) {{
  Ray ray = view_ray(uv, view_ts, relief_depth{});
{}{}{}{}{}  ReliefSurface surface;
  surface.uv = {};
  surface.height = {};
  surface.hit = {}hit.status == STATUS_HIT;
  surface.depth_offset = {} * relief_depth / ray.cosine;
{}  surface.taps = hit.taps;
  return surface;
}}
)",
      passes.empty() ? "" : ", or nothing is seen", members, is_bent ? ", const vec3 curvature" : "",
      is_lit ? ", const vec3 light_ts, const float light_radius" : "",
      has_depth ? ", const vec2 planes, const vec2 eye_depth" : "", is_bent ? ", curvature" : "",
      above.empty() ? "" : fmt::format("  ray.uv -= {} * ray.slope;  // up to the relief's top\n", above),
      has_tiles ? "  vec2 tiles = floor(ray.uv);  // dropped: small uv keep their precision far away\n"
                  "  ray.uv -= tiles;\n"
                : "",
      way_lines(settings), passes.empty() ? "" : fmt::format("  bool passes = {};\n", passes),
      is_bent ? "  unbend(ray, hit);\n" : "",
      has_tiles ? "tiles + (ray.uv + ray.slope * hit.t)" : "ray.uv + ray.slope * hit.t",
      is_bent ? "RAY_HEIGHT(ray, hit.t)" : "1.0 - hit.t", passes.empty() ? "" : "!passes && ",
      above.empty() ? "hit.t" : fmt::format("(hit.t - {})", above), values);
}

/// What ships knows how many levels its textures have, which GLSL ES cannot ask for.
std::string with_known_levels(std::string text, const std::vector<ShippedTexture>& textures) {
  for (const ShippedTexture& texture : textures) {
    const std::string call = fmt::format("textureQueryLevels({})", texture.sampler);
    for (std::size_t at = text.find(call); at != std::string::npos; at = text.find(call))
      text.replace(at, call.size(), fmt::format("{}", texture.image->levels));
  }
  return text;
}

/// A map's or the sampler's global name in the examples.
std::string bound_name(std::string_view map) { return fmt::format("bound_{}", map); }

/// `bound_relief_map, bound_extra_map, `, as a function of the text is called, with what else is an argument like them.
std::string maps_of(const Pieces& source, std::string_view function, const Settings& settings) {
  std::string list;
  for (const std::string& map : map_arguments(source, function))
    list += map != kDitherPhase
                ? bound_name(map) + ", "
                : fmt::format("relief_dither(ivec2(gl_FragCoord.xy), {}), ", is_animated(settings) ? "in_frame" : "0");
  return list;
}

}  // namespace

std::string light_radius_text(const ShippedShader& shipped) { return fmt::format("{:#}", shipped.light_radius); }

bool takes_derivatives(const Settings& settings) {
  return std::ranges::any_of(frame_features(settings),
                             [](const PixelFeature& one) { return one.feature->hook == Hook::way; });
}

bool takes_curvature(const Settings& settings) { return ray_defines(settings).contains("BENT_RAYS"); }

bool is_animated(const Settings& settings) { return frames_seen(settings) > 1; }

bool may_pass(const ShippedShader& shipped) { return !passes_when(shipped).empty(); }

std::string format_name(const TexelLayout& layout) {
  if (layout.type == TexelType::rgtc) return layout.channels == 1 ? "BC4_UNORM" : "BC5_UNORM";
  if (layout.type == TexelType::eac) return layout.channels == 1 ? "EAC_R11_UNORM" : "EAC_RG11_UNORM";
  if (layout.type == TexelType::bc7) return "BC7_UNORM";
  if (layout.type == TexelType::astc) return "ASTC_4x4_UNORM, with alpha read as green";
  std::string name;
  for (const char channel : std::string_view("RGBA").substr(0, static_cast<std::size_t>(layout.channels)))
    name += fmt::format("{}{}", channel, 8 * layout.bytes() / layout.channels);
  return name + (is_float(layout.type) ? "_SFLOAT" : "_UNORM");
}

std::vector<ShippedTexture> shipped_textures(const Settings& settings, const MapTextures& textures) {
  const MapStorage storage = storage_of(settings);
  std::vector<ShippedTexture> list = {{.sampler = kReliefMap,
                                       .binding = 0,
                                       .file = "relief",
                                       .image = &textures.relief,
                                       .format = format_name(textures.relief.layout),
                                       .channels = relief_channels(storage)}};
  if (textures.extra)
    list.push_back({.sampler = kExtraMap,
                    .binding = 1,
                    .file = "relief.extra",
                    .image = &*textures.extra,
                    .format = format_name(textures.extra->layout),
                    .channels = extra_channels(storage, map_values(settings))});
  return list;
}

std::set<std::string> shipped_entries(const ShippedShader& shipped) {
  std::set<std::string> entries = {"relief_trace"};
  if (shipped.settings.technique().reads_map()) entries.insert("relief_normal");
  if (is_dithered(shipped.settings)) entries.insert("relief_dither");
  return entries;
}

std::vector<std::string> map_arguments(const Pieces& source, std::string_view function) {
  std::vector<std::string> maps;
  for (const Piece& piece : source) {
    if (!piece.is_needed || !piece.is_function || piece.names.front() != function) continue;
    const std::size_t open = piece.text.find(fmt::format("{}(", function)) + function.size();
    const std::vector<std::string> words =
        words_of(std::string_view(piece.text).substr(open, closing(piece.text, open) - open));
    for (const char* map : {kReliefMap, kExtraMap, kReliefSampler, kDitherPhase})
      if (std::ranges::find(words, map) != words.end()) maps.emplace_back(map);
  }
  return maps;
}

Pieces shipped_source(const ShippedShader& shipped, MapArguments arguments) {
  const Technique& technique = shipped.settings.technique();
  GlslCut cut{.files = {"common.glsl", "parameters.glsl", fmt::format("{}.glsl", technique.id)},
              .roots = shipped_entries(shipped),
              .generated = {{"contract.glsl", shared_contract() + polygon(shipped.base)},
                            {"parameters.glsl", parameters_contract(technique)}},
              .defines = ray_defines(shipped.settings)};
  cut.generated.merge(stand_ins(technique));
  cut.files.emplace_back("feature_parameters.glsl");
  cut.generated.emplace("feature_parameters.glsl", feature_parameters(frame_features(shipped.settings)));
  for (const FeatureRow* row : rows_of(shipped.settings))
    if (!row->shader.empty() && row->defines.empty()) cut.files.emplace_back(row->shader);
  cut.files.insert(cut.files.end(), {"ship.glsl", "entry.glsl"});
  cut.generated.emplace("entry.glsl", entry(shipped));
  for (const SpecConstant& constant : constants_of(&shipped.settings, shipped.wrap, kShippedSampler))
    cut.constants[static_cast<int>(constant.id)] = constant.value;
  Pieces pieces = cut_glsl(cut);
  for (Piece& piece : pieces) piece.text = with_known_levels(std::move(piece.text), shipped.textures);
  pass_maps(pieces, arguments);
  keep_needed(pieces, cut.roots);
  prefix_names(pieces);
  return pieces;
}

std::string example_shader(const ShippedShader& shipped, const Pieces& source, MapArguments arguments) {
  const bool is_separate = arguments == MapArguments::separate;
  const Settings& settings = shipped.settings;
  std::string text = "#version 450\n";
  if (is_separate) text += "#extension GL_EXT_samplerless_texture_functions : require\n";
  text += "\n" + with_short_lines(text_of(source)) + R"(
// A fragment that shows the relief under a light.

#ifdef VULKAN
#define RELIEF_BINDING(n) set = 0, binding = n
#else
#define RELIEF_BINDING(n) binding = n
#endif
)";
  for (const ShippedTexture& texture : shipped.textures)
    text += fmt::format("layout(RELIEF_BINDING({})) uniform {} {};\n", texture.binding,
                        is_separate ? "texture2D" : "sampler2D", bound_name(texture.sampler));
  if (is_separate && !shipped.textures.empty())
    text +=
        fmt::format("layout(RELIEF_BINDING({})) uniform sampler {};\n", kSamplerBinding, bound_name(kReliefSampler));
  TemplateValues values;
  values.words = {{"maps", maps_of(source, "relief_trace", settings)},
                  {"normal_maps", maps_of(source, "relief_normal", settings)},
                  {"depth", fmt::format("{:#}", shipped.relief_depth)}};
  if (has_value_of(settings, Query::shadow)) values.flags.insert("shadow");
  if (has_value_of(settings, Query::depth))
    values.flags.insert({"fragdepth", settings.is("depth", "conservative") ? "conservative" : "write"});
  values.words["lights"] =
      has_value_of(settings, Query::shadow) ? fmt::format(", light, {}", light_radius_text(shipped)) : "";
  values.words["depths"] = has_value_of(settings, Query::depth) ? ", vec2(0.1, 100.0), eye_depths" : "";
  if (settings.technique().reads_map()) values.flags.insert("map");
  if (shipped.wrap == Wrap::clamp) values.flags.insert("clamp");
  if (may_pass(shipped)) values.flags.insert("passes");
  if (takes_curvature(settings)) values.flags.insert("curvature");
  if (is_animated(settings)) values.flags.insert("animated");
  values.words["curvature"] = takes_curvature(settings) ? ", in_curvature" : "";
  return text + filled_template("example.glsl", values);
}

}  // namespace reliefbench
