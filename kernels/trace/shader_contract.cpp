#include "kernels/trace/shader_contract.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>

#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "kernels/judge/depth_range.h"
#include "kernels/judge/score_pixel.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/omni_table.h"
#include "kernels/maps/sector_map.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/depth.h"
#include "kernels/trace/mesh_tracer.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/technique.h"

namespace reliefbench {
namespace {

struct Sampler {
  const char* name;
  int binding;
  std::string_view holds;
  bool is_of_mesh = false;  ///< declared where there is one alone
};
// Binding 0 is the uniform block `Frame`.
constexpr std::array kSamplers{
    Sampler{kReliefMap, 1, "r = height; g = stored cone ratio and ba = normal where it has them; of a solid g = floor"},
    Sampler{kNormalMap, 2, "xyz * 0.5 + 0.5"},
    Sampler{kReferenceMap, 3, "r = exact t of this pixel; gba = exact values of features"},
    Sampler{kExtraMap, 4, "what a map keeps apart: stored ratios, pyramid, volume or table"},
    Sampler{
        .name = kMeshMap, .binding = 5, .holds = "MESH_TEXELS a corner, three corners a triangle", .is_of_mesh = true},
};

/// How a relief map lies in its textures.
enum Layout { kTogether, kSplit, kWithNormal };
/// How a point's cone is read.
enum ConeFetch { kBilinear, kMin4 };
/// How a simulated sampler comes to its weights.
enum SimulatedWeights { kRounded, kTruncated };

/// What filter errors are counted in.
constexpr float kSamplerUnit = 0x1p-24F;

struct Choice {
  std::string_view id;
  int value;
  std::string_view meaning{};
};

std::string upper(std::string_view id) {
  std::string out(id);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return out;
}

std::string comment(std::string_view text) { return text.empty() ? "" : fmt::format("  // {}", text); }

std::string int_line(std::string_view name, int value, std::string_view meaning = "") {
  return fmt::format("const int {} = {};{}\n", name, value, comment(meaning));
}

/// value: to the bit in float
std::string float_line(std::string_view name, float value, std::string_view meaning = "") {
  return fmt::format("const float {} = {:#};{}\n", name, value, comment(meaning));
}

std::string choice_lines(std::string_view name, std::span<const Choice> choices) {
  std::string text;
  for (const Choice& choice : choices)
    text += int_line(fmt::format("{}_{}", upper(name), upper(choice.id)), choice.value, choice.meaning);
  return text;
}

/// `layout(constant_id = 3) const int LOOP = LOOP_EARLY_EXIT;`
std::string constant_line(std::string_view name, int id, std::string_view fallback) {
  return fmt::format("layout(constant_id = {}) const int {} = {};\n", id, upper(name), fallback);
}

/// A parameter's choices, then its constant.
std::string param_lines(const Param& param) {
  std::vector<Choice> choices;
  for (std::size_t i = 0; i < param.choices.size(); ++i)
    choices.push_back({.id = param.choices[i], .value = static_cast<int>(i)});
  const std::string fallback = choices.empty()
                                   ? fmt::format("{}", param.fallback)
                                   : fmt::format("{}_{}", upper(param.id), upper(param.text(param.fallback)));
  return choice_lines(param.id, choices) + constant_line(param.id, param.constant_id, fallback);
}

bool is_own(const Param& param) {
  return param.constant_id >= static_cast<int>(kFirstOwnConstant) && !is_of_scenes_row(param);
}

/// The parameters that techniques share, each once, by constant.
std::vector<const Param*> shared_params() {
  std::vector<const Param*> params;
  for (const Technique& technique : techniques())
    for (const Param& param : technique.params) {
      const bool is_known = std::ranges::find(params, param.constant_id, &Param::constant_id) != params.end();
      if (param.constant_id >= 0 && !is_own(param) && !is_of_scenes_row(param) && !is_known) params.push_back(&param);
    }
  std::ranges::sort(params, {}, &Param::constant_id);
  return params;
}

/// A shared constant that no parameter sets: its choices, the first of them its default.
std::string shared_lines(std::string_view name, int id, std::span<const Choice> choices) {
  return choice_lines(name, choices) +
         constant_line(name, id, fmt::format("{}_{}", upper(name), upper(choices.front().id)));
}

/// On the safe side.
std::int32_t in_sampler_units(double error) {
  return static_cast<std::int32_t>(std::ceil(error / static_cast<double>(kSamplerUnit)));
}

std::string sampler_lines(bool of_mesh) {
  std::string text;
  for (const Sampler& sampler : kSamplers)
    if (sampler.is_of_mesh == of_mesh)
      text += fmt::format("layout(BINDING({})) uniform sampler2D {};  // {}\n", sampler.binding, sampler.name,
                          sampler.holds);
  return text;
}

Layout layout_of(const Format& format) {
  if (format.with_normal) return kWithNormal;
  return format.extra_channels > 0 ? kSplit : kTogether;
}

}  // namespace

std::string filter_text(const SimulatedFilter& simulated) {
  return fmt::format("{} bits, {}", simulated.bits, simulated.rounds ? "rounded" : "truncated");
}

int binding_of(std::string_view sampler) {
  const auto* const found = std::ranges::find(kSamplers, sampler, &Sampler::name);
  if (found == kSamplers.end()) fail_environment("no shader has a sampler `{}`", sampler);
  return found->binding;
}

std::string shared_contract() {
  std::vector<Choice> wraps;
  wraps.reserve(kWrapRows.size());
  for (const WrapRow& row : kWrapRows) wraps.push_back({.id = row.id, .value = static_cast<int>(row.wrap)});
  constexpr std::array kLayouts{
      Choice{.id = "together", .value = kTogether, .meaning = "height and ratio in one texture"},
      Choice{.id = "split", .value = kSplit, .meaning = "ratios in extra_map"},
      Choice{.id = "with_normal", .value = kWithNormal, .meaning = "height, ratio and normal in one texture"}};
  constexpr std::array kConeFetches{
      Choice{.id = "bilinear", .value = kBilinear},
      Choice{.id = "min4", .value = kMin4, .meaning = "the narrowest cone of the four texels round the point"}};
  constexpr std::array kNone{Choice{.id = "none", .value = 0}};
  constexpr std::array kSimulatedWeights{Choice{.id = "rounded", .value = kRounded},
                                         Choice{.id = "truncated", .value = kTruncated}};
  constexpr std::array kStatuses{Choice{.id = "no_ray", .value = static_cast<int>(PixelStatus::no_ray)},
                                 Choice{.id = "hit", .value = static_cast<int>(PixelStatus::hit)},
                                 Choice{.id = "step_cap", .value = static_cast<int>(PixelStatus::step_cap)},
                                 Choice{.id = "passed", .value = static_cast<int>(PixelStatus::passed)}};
  std::string text = sampler_lines(false);
  text += "\n" + shared_lines("wrap", kWrapConstant, wraps);
  for (const Param* param : shared_params()) text += param_lines(*param);
  text += shared_lines("layout", kLayoutConstant, kLayouts);
  text += shared_lines("cone_fetch", kConeFetchConstant, kConeFetches);
  text += shared_lines("sampler_shift", kSamplerShiftConstant, kNone);
  text += shared_lines("sampler_error", kSamplerErrorConstant, kNone);
  text += float_line("SAMPLER_UNIT", kSamplerUnit, "of SAMPLER_SHIFT, in texels, and SAMPLER_ERROR");
  text += shared_lines("simulated_bits", kSimulatedBitsConstant, kNone);
  text += shared_lines("simulated_weights", kSimulatedWeightsConstant, kSimulatedWeights);
  text += "\n" + choice_lines("status", kStatuses) + "\n";
  text += int_line("DITHER_FRAMES", kDitherFrames, "that a ray's beginning goes through");
  text += float_line("LEAST_DEPTH", kLeastDepth, "under the top plate, that h_tan divides by");
  text += float_line("UNBOUNDED_RATIO", kUnboundedRatio, "of the widest cone that is stored");
  text += float_line("TILE_SIDE", kTileSide, "in the metric of distance maps, the whole range of heights being 1");
  text +=
      float_line("OMNI_TILE", kOmniTile, "in depths of the relief for which a table's directions are evenly spread");
  text += float_line("SECTOR_TANGENT", kSectorTangent, "of pi / 8");
  text += float_line("ATLAS_ROUNDING", kAtlasRounding, "of coordinates in a sector map, as a share of its side");
  text += float_line("NEAR_PLANE", static_cast<float>(kNearPlane), "of the distance to the point that is looked at");
  text += float_line("DEPTH_RANGE", static_cast<float>(kDepthRange), "far plane over near plane");
  text += float_line("FARTHEST", kFarthest, "in depth buffers, before an empty frame");
  text += float_line("SQUARE_SIDE", static_cast<float>(kSquareSide));
  text += float_line("BALL_RADIUS", static_cast<float>(kBallRadius));
  for (const auto& [id, seen] : {std::pair("SQUARE", SeenObject::square), std::pair("BALL", SeenObject::ball),
                                 std::pair("OCCLUDER", SeenObject::occluder)})
    text += float_line(fmt::format("SEEN_{}", id), static_cast<float>(seen) / 255, "alpha of its pixels");
  return text;
}

std::string parameters_contract(const Technique& technique) {
  std::string text;
  for (const Param& param : technique.params)
    if (is_own(param)) text += param_lines(param);
  return text;
}

std::map<std::string, std::string> stand_ins(const Technique& technique) {
  const bool has_sectors =
      std::ranges::any_of(technique.maps, [](MapKind kind) { return find_map(kind).content == MapContent::sectors; });
  std::map<std::string, std::string> texts;
  const auto stand_in = [&](const char* file, std::string_view for_file) {
    texts.emplace(for_file, embedded_text(embedded_shaders(), file));
  };
  if (has_sectors) stand_in("sector_sample.glsl", "cone_sample.glsl");
  if (technique.is_of_solids()) stand_in("solid_gap.glsl", "gap.glsl");
  return texts;
}

std::string feature_parameters(std::span<const PixelFeature> features) {
  std::string text;
  for (const PixelFeature& one : features)
    if (one.row != nullptr)
      for (const Param& param : one.row->params) text += param_lines(param);
  return text;
}

namespace {

/// GLSL of what features do before the trace, and of where normals are read: `Hit trace_way(inout Ray ray)` over all of
/// the former, under HAS_WAY; `normal_texel`, under HAS_NORMALS.
std::string hooks(std::span<const PixelFeature> features) {
  std::string files;
  std::string begins;
  for (const auto& [feature, row] : features) {
    if (feature->hook == Hook::none || feature->hook == Hook::silhouette) continue;
    files += fmt::format("#include \"{}\"\n", row->shader);
    if (feature->hook == Hook::way) begins += fmt::format("  begin_{}(way);\n", feature->id);
    if (feature->hook == Hook::normal) files += "#define HAS_NORMALS\n";
  }
  if (begins.empty()) return files;
  return "#define HAS_WAY\n" + files +
         fmt::format(
             "Hit trace_way(inout Ray ray) {{\n  Way way = Way(ray, pixel_at(PIXEL));\n{}"
             "  ray = way.ray;\n  return traced(ray);\n}}\n",
             begins);
}

}  // namespace

std::string frame_contract(std::span<const PixelFeature> features, SurfaceKind surface, bool has_exact_hits) {
  std::string text = has_exact_hits ? "#define HAS_EXACT_HITS\n" : "";
  if (surface_row(surface).has_mesh) text += "#define ON_MESH\n";
  for (const auto& [feature, row] : features)
    if (feature->hook == Hook::silhouette && row != nullptr)
      for (const std::string_view define : row->defines) text += fmt::format("#define {}\n", define);
  return text + float_line("LEAST_SCALE", static_cast<float>(kLeastScale), "of a surface's sides") +
         "#include \"surface_frame.glsl\"\n";
}

std::string mesh_contract() {
  return sampler_lines(true) + int_line("MESH_TEXELS", kMeshTexels, "of mesh_map, a corner") +
         int_line("MESH_WIDTH_BITS", kMeshTexelsBits, "mesh_map is 2^this wide") +
         float_line("LEAST_COSINE", static_cast<float>(kLeastCosine), "of a ray to the normal where it enters");
}

std::string features_contract(std::span<const PixelFeature> features) {
  if (features.empty()) return "";
  std::string head = feature_parameters(features) + hooks(features);
  const std::vector<PixelFeature> valued = with_values(features);
  if (valued.empty()) return head;
  head += "#define HAS_FEATURES\n#include \"feature.glsl\"\n#include \"eye.glsl\"\n";
  std::string values;
  std::string calls;
  std::string shades;
  int channel = 0;
  for (const auto& [feature, row] : valued) {
    const std::string signature =
        fmt::format("float {}(Ray ray, Scene scene, inout Hit hit)", feature->value->function);
    if (row != nullptr) head += fmt::format("#define {}_{}\n", upper(feature->id), upper(row->id));
    head += fmt::format("#include \"{}\"\n", feature->value->shader);
    ++channel;
    if (row != nullptr) {
      head += fmt::format("#include \"{}\"\n", row->shader);
    } else {
      head += fmt::format("{} {{ return texelFetch({}, ivec2(gl_FragCoord.xy), 0)[{}]; }}\n", signature, kReferenceMap,
                          channel);
    }
    values += fmt::format("  float {};\n", feature->id);
    calls += fmt::format("  values.{} = {}(ray, scene, hit);\n", feature->id, feature->value->function);
    shades += fmt::format("  shade_{}(values.{}, shading);\n", feature->id, feature->id);
  }
  return head + fmt::format(
                    "struct PixelValues {{\n{}}};\n"
                    "PixelValues values_of(Ray ray, inout Hit hit) {{\n"
                    "  Scene scene = Scene(light_here(), frame.light.w, frame.position.w, near_and_far(), "
                    "eye_depth_here());\n"
                    "  PixelValues values;\n{}  return values;\n}}\n"
                    "void shade(PixelValues values, inout Shading shading) {{\n{}}}\n",
                    values, calls, shades);
}

std::string feature_outputs(std::span<const PixelFeature> features) {
  const std::vector<PixelFeature> valued = with_values(features);
  if (valued.empty()) return "";
  std::string outputs;
  std::string puts;
  std::string zeros;
  int location = 2;  // behind the ray and the hit
  for (const PixelFeature& one : valued) {
    outputs += fmt::format("PIXEL_OUTPUT({}, r32f, float, {});\n", location++, one.feature->value->output);
    puts += fmt::format("  PUT({}, values.{});\n", one.feature->value->output, one.feature->id);
    zeros += fmt::format("  PUT({}, 0.0);\n", one.feature->value->output);
  }
  return fmt::format("{}void put(PixelValues values) {{\n{}}}\nvoid put_nothing() {{\n{}}}\n", outputs, puts, zeros);
}

std::vector<SpecConstant> constants_of(const Settings* settings, Wrap wrap, const MapSampler& sampler) {
  std::vector<SpecConstant> constants = {{.id = kWrapConstant, .value = static_cast<int>(wrap)}};
  const auto& [error, simulated] = sampler;
  constants.push_back({.id = kSimulatedBitsConstant, .value = simulated.bits});
  constants.push_back({.id = kSimulatedWeightsConstant, .value = simulated.rounds ? kRounded : kTruncated});
  if (settings == nullptr) return constants;
  const Technique& technique = settings->technique();
  for (const Param& param : technique.params)
    if (param.constant_id >= 0 && (!is_of_scenes_row(param) || settings->is_active(param)))
      constants.push_back({.id = static_cast<std::uint32_t>(param.constant_id), .value = settings->get(param.id)});
  if (technique.reads_map()) {
    const MapStorage storage = storage_of(*settings);
    constants.push_back(
        {.id = kConeFetchConstant, .value = storage.correction == Correction::min4 ? kMin4 : kBilinear});
    constants.push_back({.id = kLayoutConstant, .value = layout_of(storage.format)});
  }
  if (makes_up_for_filter(*settings)) {
    // An atlas is always read a little beside the ray.
    const bool has_atlas = map_of(*settings).content == MapContent::sectors;
    constants.push_back(
        {.id = kSamplerShiftConstant, .value = std::max(in_sampler_units(error.shift), has_atlas ? 1 : 0)});
    constants.push_back({.id = kSamplerErrorConstant, .value = in_sampler_units(error.value)});
  }
  return constants;
}

}  // namespace reliefbench
