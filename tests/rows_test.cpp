// What a setting spans: a technique's own parameters, those of its map's storage and kind, and those of features.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "kernels/base/append_file.h"
#include "kernels/base/embedded.h"
#include "kernels/trace/storage_params.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::Not;

// Ids, recorded tables and the shaders' constants have the parameters in this order.
TEST(Rows, give_techniques_the_parameters_that_ids_always_had) {
  const std::map<std::string_view, std::string> known{
      {"flat", ""},
      {"parallax", "variant format filter"},
      {"relief",
       "linear_steps least_steps texels_a_step refinement contact_steps binary_steps secant_steps loop format filter"},
      {"depth_slices", "slices loop format filter"},
      {"interval",
       "search linear_steps cone_steps interval_steps loop map search_steps correction max_ratio format encoding "
       "filter"},
      {"cone",
       "cone_steps step refinement contact_steps binary_steps secant_steps lod loop map correction max_ratio format "
       "encoding filter"},
      {"relaxed_cone",
       "cone_steps step refinement contact_steps binary_steps secant_steps loop map search_steps correction max_ratio "
       "format "
       "encoding filter"},
      {"quad_cone",
       "cone_steps step refinement contact_steps binary_steps secant_steps loop correction format encoding filter"},
      {"safety_shape",
       "cone_steps step refinement contact_steps binary_steps secant_steps loop correction max_ratio format encoding "
       "filter"},
      {"max_mip", "node_steps format"},
      {"qdm", "node_steps refinement contact_steps binary_steps secant_steps format filter"},
      {"distance",
       "sphere_steps step refinement contact_steps binary_steps secant_steps distance_slices format filter"}};
  for (const auto& [id, expected] : known) {
    const Technique& technique = find_technique(id);
    std::string ids;
    for (const Param& param : technique.params)
      if (param.is_spelt_out) ids += (ids.empty() ? "" : " ") + std::string(param.id);
    // Features of the scene came later; they stand behind all others.
    EXPECT_EQ(technique.reads_map() ? ids.substr(0, ids.find(" shadow")) : "", expected) << technique.id;
    EXPECT_EQ(technique.find("shadow") != nullptr, technique.reads_map()) << technique.id;
  }
}

TEST(Settings, hold_what_means_something) {
  Settings settings = settings_of("cone", {{"refinement", "secant"}});
  EXPECT_TRUE(settings.is("refinement", "secant"));
  EXPECT_FALSE(settings.is("refinement", "binary"));
  EXPECT_FALSE(settings.is("no_such", "secant"));
  ASSERT_NE(settings.active("secant_steps"), nullptr);
  EXPECT_EQ(settings.active("secant_steps")->id, "secant_steps");
  EXPECT_EQ(settings.active("binary_steps"), nullptr);  // it has none with this refinement
  EXPECT_EQ(settings.active("linear_steps"), nullptr);  // nor ever
  std::string text;
  for (const SettingValue& given : settings.written()) text += std::string(given.param.id) + "=" + given.text() + "&";
  EXPECT_EQ(text, settings.text() + "&");
  EXPECT_EQ(step_cap(settings), 32 + 1);
  EXPECT_FALSE(reads_levels(settings));
  EXPECT_TRUE(reads_levels(settings_of("cone", {{"lod", "footprint"}})));
}

TEST(Settings, guarantee_by_what_a_ray_is_for) {
  const auto of = [](const Settings& settings) {
    return std::pair(guarantee_of(settings), guarantee_of(settings, Query::shadow));
  };
  using enum Guarantee;
  EXPECT_EQ(of(settings_of("cone")), std::pair(exact, none));  // no shadow, no claim
  EXPECT_EQ(of(settings_of("cone", {{"shadow", "cone"}})), std::pair(exact, never_skips));
  EXPECT_EQ(of(settings_of("cone", {{"shadow", "linear"}})), std::pair(exact, none));
  EXPECT_EQ(of(settings_of("cone", {{"shadow", "cone"}, {"step", "cell_max"}})), std::pair(none, never_skips));
  EXPECT_EQ(of(settings_of("cone", {{"shadow", "cone"}, {"correction", "none"}})), std::pair(none, none));
  EXPECT_EQ(of(settings_of("cell_cone", {{"shadow", "cell"}})), std::pair(exact, never_skips));
  EXPECT_EQ(of(settings_of("cell_cone", {{"shadow", "cell"}, {"shadow_bias", "1_64"}})), std::pair(exact, none));
  // Relaxed cones are right only for rays from the top plate.
  EXPECT_EQ(of(settings_of("relaxed_cone", {{"map", "relaxed"}, {"correction", "safe"}, {"shadow", "cone"}})),
            std::pair(none, none));
}

TEST(Settings, leave_out_the_plainest_where_it_is_not_spelt_out) {
  Param shadow = choice_param("shadow", "of the relief on itself", {"none", "cone"}, "none");
  shadow.is_spelt_out = false;
  Param shadow_steps = range_param("shadow_steps", "towards the light", 1, 64, 16);
  shadow_steps.active_if = "shadow=cone";
  const Technique made{.id = "made",
                       .description = {},
                       .maps = {MapKind::height},
                       .params = {range_param("steps", "down the ray", 1, 64, 8), shadow, shadow_steps},
                       .storage = {},
                       .guarantee = Guarantee::none,
                       .guarantee_note = {},
                       .source = {}};
  Settings settings(made);
  EXPECT_EQ(settings.text(), "steps=8");
  EXPECT_EQ(settings.values().size(), 2U);
  EXPECT_EQ(settings.written().size(), 1U);
  settings.set("shadow", "cone");
  EXPECT_EQ(settings.text(), "steps=8&shadow=cone&shadow_steps=16");
  settings.set("shadow", "none");
  EXPECT_EQ(settings, Settings(made));
}

TEST(Features, bring_their_rows_parameters) {
  const Settings settings = settings_of("relief", {{"refinement", "secant"}, {"filter", "manual"}});
  std::vector<std::string_view> rows;
  for (const FeatureRow* row : rows_of(settings)) rows.push_back(row->id);
  EXPECT_THAT(rows, ElementsAre("secant", "manual", "fragment", "none", "base", "none", "base", "none", "none"));
  EXPECT_EQ(rows_of(settings_of("flat")).size(), 2U);  // dispatch, normals
  EXPECT_EQ(rows_of(settings_of("max_mip")).size(), 7U);
  EXPECT_EQ(rows_of(settings_of("distance")).size(), 6U);  // cells are fetched, until step=published; no levels
  EXPECT_EQ(rows_of(settings_of("distance", {{"step", "published"}})).size(), 8U);

  for (const Technique& technique : techniques())
    for (const Feature& feature : all_features()) {
      const Param* const param = technique.find(feature.id);
      if (param == nullptr) continue;
      EXPECT_EQ(param->description, feature.description);
      for (std::size_t i = 0; i < feature.rows.size(); ++i) {
        EXPECT_EQ(param->choices.at(i), feature.rows[i].id) << technique.id;
        for (const Param& own : feature.rows[i].params) {
          ASSERT_NE(technique.find(own.id), nullptr) << technique.id << " " << own.id;
          EXPECT_THAT(technique.find(own.id)->active_if,
                      MatchesRegex(fmt::format("{}=(.+[|])?{}([|].+)?", feature.id, feature.rows[i].id)));
        }
      }
    }
}

/// Whether a shader file includes another, itself or by one that it includes. Generated files include nothing.
bool includes(std::string_view file, std::string_view wanted) {
  const auto found = std::ranges::find(embedded_shaders(), file, &EmbeddedFile::name);
  if (found == embedded_shaders().end()) return false;
  constexpr std::string_view kInclude = "#include \"";
  for (std::size_t at = found->text.find(kInclude); at != std::string_view::npos;
       at = found->text.find(kInclude, at + 1)) {
    const std::size_t begin = at + kInclude.size();
    const std::string_view other = found->text.substr(begin, found->text.find('"', begin) - begin);
    if (other == wanted || includes(other, wanted)) return true;
  }
  return false;
}

TEST(Features, have_their_shaders_in_every_technique_that_has_them) {
  for (const Technique& technique : techniques())
    for (const Feature& feature : all_features())
      for (const FeatureRow& row : feature.rows) {
        if (technique.find(feature.id) == nullptr || row.shader.empty() || feature.is_of_scene) continue;
        EXPECT_TRUE(includes(fmt::format("{}.glsl", technique.id), row.shader)) << technique.id << " " << row.id;
      }
}

TEST(Features, of_the_scene_are_in_no_text_but_that_of_frames_that_have_them) {
  const Settings off = settings_of("cone");
  EXPECT_EQ(off.text().find("shadow"), std::string::npos);
  EXPECT_TRUE(pixel_features(off).empty());
  EXPECT_EQ(features_contract({}), "");
  EXPECT_EQ(feature_outputs({}), "");
  EXPECT_EQ(parameters_contract(off.technique()).find("SHADOW"), std::string::npos);
  EXPECT_EQ(shared_contract().find("SHADOW"), std::string::npos);

  const Settings on = settings_of("cone", {{"shadow", "cone"}});
  EXPECT_THAT(on.text(), EndsWith("&shadow=cone&shadow_steps=16&shadow_bias=none"));
  const std::vector<PixelFeature> features = pixel_features(on);
  ASSERT_EQ(features.size(), 1U);
  EXPECT_EQ(text_of(features), "shadow=cone");
  EXPECT_EQ(text_of(exact_ones(features)), "shadow=exact");
  EXPECT_THAT(features_contract(features), HasSubstr("const int SHADOW_STEPS = 16;"));
  EXPECT_THAT(features_contract(exact_ones(features)), Not(HasSubstr("SHADOW_STEPS")));
  EXPECT_EQ(score_target(features).attachments.size(), 3U);
  for (const SpecConstant& constant : constants_of(&off, Wrap::repeat)) EXPECT_LT(constant.id, kFirstFeatureConstant);
  EXPECT_EQ(constants_of(&on, Wrap::repeat).size(), constants_of(&off, Wrap::repeat).size() + 2);
}

TEST(Features, say_what_a_row_lacks) {
  const FeatureRow content{.id = "any", .description = {}};
  const FeatureRow needy{.id = "cone", .description = {}, .lacks = [](const Settings& settings) -> std::string {
                           return map_of(settings).ratios > 0 ? "" : "shadow=cone needs a cone map";
                         }};
  EXPECT_EQ(lacking({&content, &needy}, settings_of("relief")), "shadow=cone needs a cone map");
  EXPECT_EQ(lacking({&content, &needy}, settings_of("cone")), "");
  EXPECT_EQ(lacking({}, settings_of("relief")), "");
}

std::string values_text(const Settings& settings) {
  std::string text;
  for (const MapValue& given : map_values(settings)) text += fmt::format("{}={} ", given.param, given.value);
  return text;
}

TEST(MapParameters, reach_the_baker_from_settings) {
  EXPECT_EQ(values_text(settings_of("relief")), "");
  EXPECT_EQ(values_text(settings_of("distance", {{"distance_slices", "8"}})), "distance_slices=8 ");
  EXPECT_EQ(values_text(settings_of("relaxed_cone", {{"search_steps", "64"}})), "search_steps=64 ");
  EXPECT_EQ(values_text(settings_of("relaxed_cone", {{"map", "relaxed"}})), "");
  EXPECT_EQ(values_text(settings_of("interval")), "");
  EXPECT_EQ(values_text(settings_of("interval", {{"search", "cone"}})), "search_steps=128 ");

  const Heightfield heights{.width = 4, .height = 4, .texels = std::vector<float>(16, 0.5F)};
  const Settings settings = settings_of("distance", {{"distance_slices", "8"}});
  const BakeSpec spec = bake_spec(settings, Wrap::repeat);
  EXPECT_EQ(parameters_text({.heights = heights, .parameters = spec.parameters}, spec.storage.map),
            "distance_slices=8");
  EXPECT_EQ(bake(spec, heights).values.size(), 8U * 16);
  EXPECT_EQ(parameters_text({.heights = heights}, find_map("relaxed_po07")), "search_steps=128");  // its default
  EXPECT_EQ(parameters_text({.heights = heights}, find_map("quick")), "");
}

// A map kind with parameters of its own as a later one may be: two of them, one with named values.
TEST(MapParameters, may_be_several_and_named) {
  constexpr std::array<std::string_view, 3> kCounts{"4", "8", "16"};
  const MapParam sectors{.id = "sectors", .description = "round a texel", .max = 2, .fallback = 1, .choices = kCounts};
  const MapParam rings{.id = "rings", .description = "round a texel", .min = 1, .max = 4, .fallback = 2};
  const std::array both{sectors, rings};
  MapRow row = find_map(MapKind::quad);
  row.parameters = both;
  const Param param = map_param(sectors);
  EXPECT_EQ(param.stage, Stage::bake);
  EXPECT_EQ(param.text(param.fallback), "8");
  EXPECT_EQ(param.parse("16"), 2);
  EXPECT_THROW((void)param.parse("5"), Error);
  EXPECT_THROW((void)map_param(rings).parse("0"), Error);
  const Heightfield heights{.width = 4, .height = 4, .texels = std::vector<float>(16, 0.5F)};
  const BakeRequest request{.heights = heights, .parameters = {{"sectors", 2}}};
  EXPECT_EQ(request.value(sectors), 2);
  EXPECT_EQ(request.value(rings), 2);
  EXPECT_EQ(parameters_text(request, row), "sectors=2&rings=2");
}

// So that a map kind with a parameter of its own is its row and its baker, and nothing else.
TEST(MapParameters, are_named_by_their_maps_alone) {
  for (const MapRow& map : map_kinds())
    for (const MapParam& param : map.parameters)
      for (const char* module : {"kernels", "backends", "tuner", "reports"})
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / module)) {
          const std::string extension = entry.path().extension();
          if (extension != ".h" && extension != ".cpp" && extension != ".js") continue;
          if (entry.path().parent_path().filename() == "maps") continue;
          const std::string text = read_file(entry.path());
          EXPECT_EQ(text.find(fmt::format("\"{}\"", param.id)), std::string::npos) << entry.path() << " " << param.id;
        }
}

}  // namespace
}  // namespace reliefbench
