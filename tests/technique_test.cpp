#include "kernels/trace/technique.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <set>

#include "backends/spirv.h"
#include "kernels/base/embedded.h"
#include "kernels/image/heightmap.h"
#include "tests/technique_rig.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return out;
}

TEST(TechniqueTest, rows_and_shader_files_are_one_to_one) {
  std::set<std::string> files;
  const auto has = [](const EmbeddedFile& file, std::string_view text) {
    return file.text.find(text) != std::string_view::npos;
  };
  for (const EmbeddedFile& file : embedded_shaders())
    // A trace of its own, or another technique's over another map.
    if (file.name != "reference.glsl" &&
        (has(file, "Hit trace(Ray ray)") || has(file, "#include \"relaxed_cone.glsl\"") ||
         has(file, "#include \"cone.glsl\"")))
      files.emplace(file.name.substr(0, file.name.find('.')));
  std::set<std::string> rows;
  for (const Technique& technique : techniques()) rows.emplace(technique.id);
  EXPECT_EQ(files, rows);
}

/// The names that lines of GLSL define as constants.
std::set<std::string> constants_in(std::string_view text) {
  static const std::regex kConstant(R"(const (?:int|float) (\w+) =)");
  const std::string copy(text);
  std::set<std::string> names;
  for (std::sregex_iterator match(copy.begin(), copy.end(), kConstant), end; match != end; ++match)
    names.insert((*match)[1]);
  return names;
}

TEST(TechniqueTest, no_shader_file_repeats_what_a_row_defines) {
  std::set<std::string> generated = constants_in(shared_contract());
  EXPECT_THAT(generated, testing::IsSupersetOf({"WRAP_CLAMP", "ENCODING_ATAN", "LAYOUT_SPLIT", "CONE_FETCH_MIN4",
                                                "STATUS_STEP_CAP", "LEAST_DEPTH", "TILE_SIDE"}));
  for (const Technique& technique : techniques()) generated.merge(constants_in(parameters_contract(technique)));
  EXPECT_THAT(generated,
              testing::IsSupersetOf({"CONE_STEPS", "STEP_CELL_QUAD", "REFINEMENT_BINARY", "OVER_RELAXATION_AUTO"}));
  for (const EmbeddedFile& file : embedded_shaders()) {
    if (file.name == "load.glsl") continue;  // its constant is the audit's, and no row's
    EXPECT_EQ(file.text.find("constant_id"), std::string_view::npos) << file.name;
    for (const std::string& name : constants_in(file.text)) EXPECT_FALSE(generated.contains(name)) << file.name << name;
    for (const char* sampler : {kReliefMap, kNormalMap, kReferenceMap, kExtraMap})
      EXPECT_EQ(file.text.find(fmt::format("sampler2D {};", sampler)), std::string_view::npos) << file.name;
  }
}

/// Sets what `param` needs to be active: the first choice that makes sense.
void activate(Settings& settings, const Param& param) {
  if (param.active_if.empty()) return;
  const std::string_view condition = param.active_if;
  const std::size_t split = condition.find('=');
  const std::string_view id = condition.substr(0, split);
  activate(settings, *settings.technique().find(id));
  if (settings.is_active(param)) return;
  for (std::string_view rest = condition.substr(split + 1); !rest.empty();) {
    const std::size_t end = std::min(rest.find('|'), rest.size());
    settings.set(id, rest.substr(0, end));
    if (conflict(settings).empty()) return;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

/// Every feature of the scene is in its own modules only.
Spirv module_of(const Settings& settings) {
  const std::vector<PixelFeature> features = frame_features(settings);
  return compile_fragment(settings.technique().id, score_target(features), Dialect::vulkan, features);
}

TEST(TechniqueTest, every_run_time_parameter_is_a_constant_of_the_module) {
  for (const Technique& technique : techniques()) {
    for (const Param& param : technique.params) {
      if (param.constant_id < 0) continue;
      Settings settings(technique);
      activate(settings, param);
      std::map<std::uint32_t, std::string> declared;
      for (const DeclaredConstant& constant : reflect(module_of(settings)).constants)
        declared[constant.id] = constant.name;
      EXPECT_EQ(declared[static_cast<std::uint32_t>(param.constant_id)], upper(param.id))
          << technique.id << "." << param.id;
    }
  }
}

TEST(TechniqueTest, constants_of_the_module_are_all_parameters) {
  for (const Technique& technique : techniques()) {
    for (const DeclaredConstant& constant :
         reflect(compile_fragment(technique.id, Target::score, Dialect::vulkan)).constants) {
      if (constant.id < kFirstOwnConstant) continue;  // shared ones, which a technique may ignore
      const bool known = std::any_of(technique.params.begin(), technique.params.end(), [&](const Param& param) {
        return param.constant_id == static_cast<int>(constant.id);
      });
      EXPECT_TRUE(known) << technique.id << " declares " << constant.name;
    }
  }
}

TEST(TechniqueTest, defaults_are_in_range_and_sensible) {
  for (const Technique& technique : techniques()) {
    EXPECT_EQ(conflict(Settings(technique)), "") << technique.id;
    for (const Param& param : technique.params) {
      EXPECT_LE(param.min, param.fallback) << technique.id << "." << param.id;
      EXPECT_GE(param.max, param.fallback) << technique.id << "." << param.id;
      EXPECT_FALSE(param.description.empty());
    }
  }
}

TEST(SettingsTest, inactive_parameters_vanish) {
  Settings settings = settings_of("relief", {{"refinement", "none"}});
  EXPECT_EQ(settings.text(), "linear_steps=16&refinement=none&loop=early_exit&format=r8&filter=hardware");
  settings.set("binary_steps", 9);
  EXPECT_EQ(settings.text(), "linear_steps=16&refinement=none&loop=early_exit&format=r8&filter=hardware");
  settings.set("refinement", "binary");
  EXPECT_EQ(settings.get("binary_steps"), 9);
}

TEST(SettingsTest, what_depends_on_an_inactive_parameter_is_inactive) {
  Settings settings = settings_of("distance", {{"step", "cell_quad"}});
  EXPECT_EQ(settings.text(), "sphere_steps=64&step=cell_quad&distance_slices=32&format=r16");
  settings.set("step", "published");
  EXPECT_EQ(settings.text(),
            "sphere_steps=64&step=published&refinement=binary&binary_steps=6&distance_slices=32&format=r16"
            "&filter=hardware");
}

// Whatever its default.
TEST(SettingsTest, the_map_of_an_inactive_parameter_is_the_first) {
  Settings settings(find_technique("interval"));
  EXPECT_EQ(settings.text(),
            "search=linear&linear_steps=16&interval_steps=2&loop=early_exit&format=rg16&filter=hardware");
  EXPECT_EQ(map_of(settings).kind, MapKind::height);
  settings.set("search", "cone");
  EXPECT_EQ(settings.text(),
            "search=cone&cone_steps=15&interval_steps=2&loop=early_exit&map=relaxed_po07&search_steps=128&"
            "correction=none&max_ratio=1&format=rg16&encoding=sqrt&filter=hardware");
  settings.set("map", "conservative");
  EXPECT_FALSE(settings.is_active(*settings.technique().find("search_steps")));
}

TEST(SettingsTest, bad_values_are_refused_with_what_was_expected) {
  const auto refusal = [](std::string_view id, std::string_view value) -> std::string {
    try {
      settings_of("relief", {{id, value}});
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Exit::bad_input);
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(refusal("linear_steps", "0"), "linear_steps=0 is out of range (expected 1 to 4096)");
  EXPECT_EQ(refusal("linear_steps", "12x"), "linear_steps='12x' is not an integer");
  EXPECT_EQ(refusal("refinement", "magic"),
            "refinement='magic' is unknown (expected one of none, secant, binary, contact)");
  EXPECT_TRUE(refusal("cone_steps", "3").starts_with("technique 'relief': parameter 'cone_steps' is unknown ("));
  EXPECT_TRUE(
      refusal("linear_stepps", "3")
          .starts_with("technique 'relief': parameter 'linear_stepps' is unknown (did you mean 'linear_steps'?"));
  EXPECT_THROW(static_cast<void>(find_technique("bump")), Error);
}

TEST(SettingsTest, a_cone_map_needs_two_channels) {
  EXPECT_NE(conflict(settings_of("cone", {{"format", "r16"}})), "");
  EXPECT_EQ(conflict(settings_of("relief", {{"format", "rg16"}})), "");
}

TEST(SettingsTest, pyramids_and_volumes_need_formats_of_one_channel) {
  for (const std::string_view technique : {"max_mip", "qdm", "distance", "omni"}) {
    for (const Format& format : formats()) {
      const bool fits = format.channels == 1 && format.extra_channels == 0 && !is_of_blocks(format.type);
      EXPECT_EQ(conflict(settings_of(technique, {{"format", format.id}})).empty(), fits) << technique << format.id;
    }
  }
}

TEST(SettingsTest, only_conservative_maps_keep_the_guarantee_of_cone) {
  for (const std::string_view map : {"conservative", "quick", "quick_naive"})
    EXPECT_EQ(guarantee_of(settings_of("cone", {{"map", map}})), Guarantee::exact) << map;
  for (const std::string_view map : {"quick_published", "quick_centre"})
    EXPECT_EQ(guarantee_of(settings_of("cone", {{"map", map}})), Guarantee::none) << map;
}

TEST(SettingsTest, search_steps_belong_to_one_map) {
  EXPECT_NE(settings_of("relaxed_cone").text().find("search_steps=128"), std::string::npos);
  EXPECT_EQ(settings_of("relaxed_cone", {{"map", "relaxed"}}).text().find("search_steps"), std::string::npos);
  EXPECT_NE(conflict(settings_of("relaxed_cone", {{"correction", "safe"}})), "");
  EXPECT_EQ(conflict(settings_of("relaxed_cone", {{"map", "relaxed"}, {"correction", "safe"}})), "");
}

using TechniqueOnDevices = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, TechniqueOnDevices, ::testing::Values("opengl", "vulkan"),
                         [](const auto& parameter) { return std::string(parameter.param); });

/// Another value of a parameter than its default, near it, so that the frame stays cheap.
int other_value(const Param& param) { return param.fallback < param.max ? param.fallback + 1 : param.min; }

/// The format that rounds nothing and holds any of the technique's maps.
std::string_view float_format(const Technique& technique) {
  int ratios = 0;
  for (const MapKind map : technique.maps) ratios = std::max(ratios, values_beside(find_map(map)));
  return ratios == 0 ? "r32f" : (ratios == 1 ? "rg32f" : "r32f+rgba32f");
}

// Cones that the map does not keep safe pierce the surface, so that each refinement has something to do; few steps
// leave some rays short, so that one more step shows.
void make_sensitive(Settings& settings) {
  const Technique& technique = settings.technique();
  const std::string_view id = technique.id;
  if (technique.guarantee != Guarantee::none && technique.find("correction") != nullptr) {
    settings.set("correction", "none");
    if (technique.find("step") != nullptr) settings.set("step", "cell_max");
  }
  if (id == "max_mip" || id == "qdm" || id == "double_mip") settings.set("node_steps", 4);
  if (id == "distance") settings.set("sphere_steps", 4);
  if (settings.active("texels_a_step") != nullptr) settings.set("least_steps", 1);
  if (technique.find("cone_steps") != nullptr) settings.set("cone_steps", 8);
  if (technique.find("max_ratio") != nullptr) settings.set("format", float_format(technique));
}

/// What a frame shows of the code that ran: t and taps of each pixel, and the values of the features.
struct RunFrame {
  std::vector<std::pair<float, float>> pixels;
  FeatureValues values;

  bool operator==(const RunFrame&) const = default;
};

RunFrame run_frame(const Rig& rig, const Settings& settings, const Scene& scene) {
  RunFrame run;
  for (const ScorePixel& pixel : trace_frame(rig, settings, store_map(settings, small_fbm(), scene.wrap), scene))
    run.pixels.emplace_back(pixel.t, pixel.taps);
  run.values = rig.backend->read_values(pixel_features(settings));
  return run;
}

TEST_P(TechniqueOnDevices, every_parameter_changes_what_runs) {
  on_every_device([](const Rig& rig) {
    const Scene scene{.view = view_presets()[1],
                      .tiling = 2,
                      .width_px = 48,
                      .height_px = 48,
                      .light = {.elevation_deg = 20, .angular_radius_deg = 2}};
    std::map<std::string, RunFrame> frames;  // many parameters are changed from the same settings
    const auto frame_of = [&](const Settings& settings) -> const RunFrame& {
      const auto [found, is_new] = frames.try_emplace(std::string(settings.technique().id) + settings.text());
      if (is_new) found->second = run_frame(rig, settings, scene);
      return found->second;
    };
    // What techniques share is tried in every fourth of them. How constants get into a pipeline is the API's matter,
    // not the parameter's: a technique's own are tried on Vulkan, where a pipeline compiles sooner.
    std::map<std::string_view, int> met;
    for (const Technique& technique : techniques()) {
      for (const Param& param : technique.params) {
        const int turn = met[param.id]++ % 4;
        if (turn != (rig.row.id == "opengl" ? 2 : 0) && !is_thorough()) continue;
        if (param.min == param.max || param.id == "normals") continue;  // these show in pictures: filtering_test.cpp
        if (param.id == "ratios_a_texel") continue;  // the same hits: what it is for shows in guarantee_test.cpp
        if (param.id == "omni_order") continue;      // the same hits: omni_test.cpp
        if (param.id == "dispatch") continue;        // the same frames: compute_dispatch_test.cpp
        if (param.id == "silhouette") continue;      // a plane has none: surface_test.cpp
        Settings before(technique);
        activate(before, param);
        make_sensitive(before);
        Settings after = before;
        after.set(param.id, before.get(param.id) == param.fallback ? other_value(param) : param.fallback);
        if (!conflict(after).empty()) after.set(param.id, param.id == "format" ? "rg32f" : after.choice(param.id));
        ASSERT_EQ(conflict(after), "");
        EXPECT_FALSE(frame_of(before) == frame_of(after)) << before.text() << "  and  " << after.text();
      }
    }
  });
}

TEST_P(TechniqueOnDevices, every_technique_finds_a_constant_surface) {
  on_every_device([](const Rig& rig) {
    std::size_t number = 0;
    for (const Technique& technique : techniques()) {
      if (technique.id == "flat" || !is_tried_here(rig, number++)) continue;
      Settings settings(technique);
      settings.set("format", float_format(technique));
      if (technique.id == "parallax") settings.set("variant", "plain");
      if (technique.find("binary_steps") != nullptr) settings.set("binary_steps", 16);
      if (technique.find("cone_steps") != nullptr) settings.set("cone_steps", 500);
      if (technique.id == "depth_slices") settings.set("slices", 4096);
      if (technique.id == "depth_passes") settings.set("passes", 512);
      const double tolerance = technique.id == "depth_slices"   ? 1.0 / 4096
                               : technique.id == "depth_passes" ? 1.0 / 512
                                                                : 1e-4;
      const auto pipeline = score_pipeline(rig, settings, Wrap::repeat);
      for (const float height : {0.0F, 0.5F, 1.0F}) {
        if (technique.is_of_solids() && height == 0) continue;  // no thickness: it passes
        const Heightfield map = {.width = 8, .height = 8, .texels = std::vector<float>(64, height)};
        const StoredMap stored = store_map(settings, map, Wrap::repeat);
        for (const View& view : view_presets()) {
          const Scene scene{.view = view, .width_px = 16, .height_px = 16};
          for (const ScorePixel& pixel : trace_frame(rig, *pipeline, stored, scene, &settings)) {
            if (static_cast<PixelStatus>(pixel.status) == PixelStatus::no_ray) continue;
            ASSERT_EQ(static_cast<PixelStatus>(pixel.status), PixelStatus::hit) << settings.text() << " " << view.id;
            ASSERT_NEAR(pixel.t, 1 - height, tolerance) << settings.text() << " " << view.id;
          }
        }
      }
    }
  });
}

TEST_P(TechniqueOnDevices, no_cone_steps_leave_every_ray_at_the_top) {
  on_every_device([](const Rig& rig) {
    const Settings settings = settings_of("cone", {{"cone_steps", "0"}});
    const Scene scene{.view = view_presets()[0], .width_px = 16, .height_px = 16};
    for (const ScorePixel& pixel : trace_frame(rig, settings, store_map(settings, small_fbm(), scene.wrap), scene)) {
      EXPECT_EQ(pixel.t, 0);
      EXPECT_EQ(pixel.taps, 1);
    }
  });
}

TEST_P(TechniqueOnDevices, the_two_loops_find_the_same_hits) {
  on_every_device([](const Rig& rig) {
    const Scene scene{.view = view_presets()[2], .tiling = 2, .width_px = 48, .height_px = 48};
    for (const Technique& technique : techniques()) {
      if (technique.find("loop") == nullptr) continue;
      Settings settings(technique);
      const StoredMap map = store_map(settings, small_fbm(), scene.wrap);
      settings.set("loop", "fixed");
      const auto fixed = trace_frame(rig, settings, map, scene);
      settings.set("loop", "early_exit");
      const auto early = trace_frame(rig, settings, map, scene);
      for (std::size_t i = 0; i < fixed.size(); ++i) {
        EXPECT_EQ(fixed[i].t, early[i].t) << technique.id;
        EXPECT_GE(fixed[i].taps, early[i].taps) << technique.id;
      }
    }
  });
}

}  // namespace
}  // namespace reliefbench
