#include "tuner/plan/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Config parsed_config(std::string text) { return parse_config(std::move(text), "c.json"); }

std::string config_error(std::string text) {
  try {
    (void)parsed_config(std::move(text));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

/// A config with one sweep and one scene; line 4 is the scene's own, line 5 the sweep's.
std::string config_with(std::string_view scene, std::string_view sweep) {
  return fmt::format("{{\n\"name\": \"n\",\n\"scenes\": [\n{}\n], \"sweeps\": [{}]}}\n", scene, sweep);
}
constexpr std::string_view kSceneJson = R"({"heightmap": "rocks", "views": ["top"]})";
constexpr std::string_view kSweep = R"({"technique": "relief"})";

TEST(Config, DefaultsWhereNothingIsSaid) {
  const Config config = parse_config(R"({"scenes": {"heightmap": "rocks", "views": "top"},
                                         "sweeps": {"technique": "flat"}})",
                                     "folder/nightly.json");
  EXPECT_EQ(config.name, "nightly");
  EXPECT_EQ(config.seed, 1U);
  ASSERT_EQ(config.scenes.size(), 1U);
  EXPECT_EQ(config.scenes[0].id, "rocks/top");
  EXPECT_EQ(config.scenes[0].scene.width_px, 256);
  EXPECT_EQ(config.measure.samples, MeasureSpec{}.samples);
  EXPECT_EQ(config.front_error, "e_xy.p99");
  ASSERT_EQ(config.budgets.size(), 2U);
  ASSERT_EQ(config.sweeps.size(), 1U);
  EXPECT_TRUE(config.sweeps[0].axes.empty());
}

TEST(Config, ChoicesThatAreNumbersMayBeWrittenAsNumbers) {
  const auto sweep = [](std::string_view axes) {
    return config_with(kSceneJson, fmt::format(R"({{"technique": "sector_cone", "axes": {}}})", axes));
  };
  const Config texts = parsed_config(sweep(R"({"sectors": ["4", "16"]})"));
  const Config numbers = parsed_config(sweep(R"({"sectors": [4, 16]})"));
  ASSERT_EQ(numbers.sweeps[0].axes.size(), 1U);
  EXPECT_EQ(numbers.sweeps[0].axes[0].values, texts.sweeps[0].axes[0].values);
  EXPECT_TRUE(config_error(sweep(R"({"sectors": 5})")).ends_with("known: 4, 8, 16)"));
}

TEST(Config, EverythingIsRead) {
  const Config config = parsed_config(R"({
    // a comment, and /* another kind */
    "$schema": "schema/config.schema.json", "name": "all", "seed": 18446744073709551,
    "scenes": [{"heightmap": {"source": "rocks", "channel": "r", "invert": true, "normalise": true, "name": "low"},
                "views": ["grazing", {"id": "steep", "elevation_deg": 60, "distance": 2, "fov_deg": 30}],
                "relief_depth": 0, "tiling": 0.001, "wrap": "clamp", "frame_px": [320, 200],
                "light": {"elevation_deg": 20, "angular_radius_deg": 0.25}}],
    "measure": {"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 0, "control_every": 2, "block_cases": 8,
                "flicker_frames": 5, "timeout_s": 1.5},
    "front": {"error": "e_z.p95", "constraints": []},
    "budgets": ["psnr >= 30", "missed_rate<=0.001"],
    "sweeps": [{"technique": "relief", "combine": "product",
                "axes": {"linear_steps": {"from": 8, "to": 100, "times": 2},
                         "refinement,binary_steps": [["none", 0], ["binary", 6]],
                         "secant_steps": {"from": 0, "to": 4, "step": 2}, "format": "r16"},
                "where": {"if": {"format": "r8"}, "then": {"filter": ["hardware", "manual"]}}}]})");
  EXPECT_EQ(config.seed, 18446744073709551U);
  ASSERT_EQ(config.scenes.size(), 2U);
  const SceneSpec& steep = config.scenes[1];
  EXPECT_EQ(steep.id, "low/steep");
  EXPECT_EQ(steep.heightmap.channel, "r");
  EXPECT_TRUE(steep.heightmap.invert && steep.heightmap.normalise);
  EXPECT_EQ(steep.scene.view.elevation_deg, 60);
  EXPECT_EQ(steep.scene.relief_depth, 0);
  EXPECT_EQ(steep.scene.tiling, 0.001);
  EXPECT_EQ(steep.scene.wrap, Wrap::clamp);
  EXPECT_EQ(steep.scene.width_px, 320);
  EXPECT_EQ(steep.scene.light, (Light{.elevation_deg = 20, .angular_radius_deg = 0.25}));
  EXPECT_EQ(steep.scene.height_px, 200);
  EXPECT_EQ(config.measure.batch_ms, 0.5);
  EXPECT_EQ(config.measure.warmup_batches_max, 0);
  EXPECT_EQ(config.front_error, "e_z.p95");
  EXPECT_TRUE(config.front_constraints.empty());
  EXPECT_EQ(config.budgets[0].text(), "psnr>=30");
  EXPECT_EQ(config.budgets[1].text(), "missed_rate<=0.001");
  const SweepSpec& sweep = config.sweeps[0];
  EXPECT_EQ(sweep.line, 12);
  ASSERT_EQ(sweep.axes.size(), 4U);
  EXPECT_THAT(sweep.axes[0].values, ElementsAre(ElementsAre(8), ElementsAre(16), ElementsAre(32), ElementsAre(64)));
  EXPECT_THAT(sweep.axes[1].params, ElementsAre("refinement", "binary_steps"));
  EXPECT_THAT(sweep.axes[1].values, ElementsAre(ElementsAre(0, 0), ElementsAre(2, 6)));
  EXPECT_THAT(sweep.axes[2].values, ElementsAre(ElementsAre(0), ElementsAre(2), ElementsAre(4)));
  EXPECT_THAT(sweep.axes[3].values, ElementsAre(ElementsAre(1)));
  EXPECT_THAT(sweep.where[0].then[0].second, ElementsAre(0, 1));
}

struct Broken {
  std::string name;
  std::string text;
  int line;
  std::string key;  ///< "" for syntax errors
  std::string what;
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

std::vector<Broken> broken_configs() {
  const auto scene = [](std::string_view text) { return config_with(text, kSweep); };
  const auto sweep = [](std::string_view text) { return config_with(kSceneJson, text); };
  const auto more = [](std::string_view text) {
    return fmt::format("{{\"scenes\": {},\n\"sweeps\": {},\n{}}}", kSceneJson, kSweep, text);
  };
  return {
      {"syntax", "{\n\"a\": 1,\n\"b\" 2}", 3, "", "not valid JSON"},
      {"unclosed", "{\n\"name\": \"x\"\n\n", 3, "", "not valid JSON"},
      {"empty_file", "", 1, "", "not valid JSON"},
      {"no_object", "[1]", 1, "", "expected an object, not array"},
      {"huge_number", "{\"seed\":\n1e999}", 2, "", "not valid JSON"},
      {"deep", std::string(100, '['), 1, "", "over 64 levels deep"},
      {"duplicate", "{\"seed\": 1,\n\"seed\": 2}", 2, "seed", "stands twice, first in line 1"},
      {"unknown_key", more("\"budgetz\": []"), 3, "budgetz", "unknown (did you mean 'budgets'?; known: $schema, name"},
      {"far_key", more("\"colour\": []"), 3, "colour", "unknown (known: $schema, name"},
      {"no_scenes", "{\"sweeps\": []}", 1, "", "'scenes' is missing"},
      {"empty_scenes", "{\n\"scenes\": []}", 2, "scenes", "the list is empty"},
      {"no_sweeps", fmt::format("{{\"scenes\": {}}}", kSceneJson), 1, "", "'sweeps' is missing"},
      {"empty_sweeps", config_with(kSceneJson, ""), 5, "sweeps", "the list is empty"},
      {"name_type", more("\"name\": 3"), 3, "name", "expected a string, not number"},
      {"seed_negative", more("\"seed\": -1"), 3, "seed", "-1 is out of range"},
      {"seed_huge", more("\"seed\": 18446744073709551615"), 3, "seed", "18446744073709551615 is out of range"},
      // scenes
      {"scene_type", scene("7"), 4, "scenes[0]", "expected an object, not number"},
      {"scene_key", scene(R"({"heightmap": "rocks", "view": "top"})"), 4, "scenes[0].view", "did you mean 'views'?"},
      {"no_views", scene(R"({"heightmap": "rocks"})"), 4, "scenes[0]", "'views' is missing"},
      {"empty_views", scene(R"({"heightmap": "rocks", "views": []})"), 4, "scenes[0].views", "the list is empty"},
      {"unknown_view", scene(R"({"heightmap": "rocks", "views": ["topp"]})"), 4, "scenes[0].views[0]",
       "did you mean 'top'?"},
      {"view_twice", scene(R"({"heightmap": "rocks", "views": ["top", "top"]})"), 4, "scenes[0]", "stands twice"},
      {"view_preset_id", scene(R"({"heightmap": "rocks", "views": [{"id": "top"}]})"), 4, "scenes[0].views[0].id",
       "is a preset"},
      {"view_id", scene(R"({"heightmap": "rocks", "views": [{"id": "a/b"}]})"), 4, "scenes[0].views[0].id",
       "letters, digits"},
      {"view_no_id", scene(R"({"heightmap": "rocks", "views": [{}]})"), 4, "scenes[0].views[0]", "'id' is missing"},
      {"elevation_below", scene(R"({"heightmap": "rocks", "views": {"id": "v", "elevation_deg": -91}})"), 4,
       "scenes[0].views.elevation_deg", "-91 is out of range (expected a number in [-90, 90])"},
      {"elevation_91", scene(R"({"heightmap": "rocks", "views": {"id": "v", "elevation_deg": 90.5}})"), 4,
       "scenes[0].views.elevation_deg", "90.5 is out of range"},
      {"fov", scene(R"({"heightmap": "rocks", "views": {"id": "v", "fov_deg": 180}})"), 4, "scenes[0].views.fov_deg",
       "180 is out of range"},
      {"distance", scene(R"({"heightmap": "rocks", "views": {"id": "v", "distance": 0}})"), 4,
       "scenes[0].views.distance", "expected a number above 0"},
      {"depth", scene("{\"heightmap\": \"rocks\", \"views\": \"top\",\n\"relief_depth\": -0.1}"), 5,
       "scenes[0].relief_depth", "-0.1 is out of range (expected a number of at least 0)"},
      {"base", scene(R"({"heightmap": "rocks", "views": "top", "base": 1.5})"), 4, "scenes[0].base",
       "1.5 is out of range (expected a number in [0, 1])"},
      {"base_round", scene(R"({"heightmap": "rocks", "views": "top", "base": 0, "surface": "sphere"})"), 4,
       "scenes[0].base", "base needs a plane, not a sphere"},
      {"base_over_eye", scene(R"({"heightmap": "rocks", "views": "oblique", "base": 0.5, "relief_depth": 2})"), 4,
       "scenes[0].base",
       "the camera is inside the relief: 0.8 over the polygon, over which a relief 2 deep of base 0.5 reaches 1"},
      {"tiling", scene(R"({"heightmap": "rocks", "views": "top", "tiling": 0})"), 4, "scenes[0].tiling",
       "0 is out of range (expected a number above 0)"},
      {"wrap", scene(R"({"heightmap": "rocks", "views": "top", "wrap": "mirror"})"), 4, "scenes[0].wrap",
       "known: repeat, clamp"},
      {"frame_list", scene(R"({"heightmap": "rocks", "views": "top", "frame_px": 256})"), 4, "scenes[0].frame_px",
       "expected [width, height]"},
      {"frame_name", scene(R"({"heightmap": "rocks", "views": "top", "frame_px": "1080"})"), 4, "scenes[0].frame_px",
       "'1080' is unknown (did you mean '1080p'?; known: 720p, 1080p, 1440p, 4k)"},
      {"frame_0", scene(R"({"heightmap": "rocks", "views": "top", "frame_px": [0, 1]})"), 4, "scenes[0].frame_px[0]",
       "0 is out of range (expected 1 to 16384)"},
      {"frame_side", scene(R"({"heightmap": "rocks", "views": "top", "frame_px": [1, 16385]})"), 4,
       "scenes[0].frame_px[1]", "16385 is out of range"},
      {"frame_float", scene(R"({"heightmap": "rocks", "views": "top", "frame_px": [1.5, 2]})"), 4,
       "scenes[0].frame_px[0]", "expected an integer from 1 to 16384, not 1.5"},
      {"no_heightmap", scene(R"({"views": "top"})"), 4, "scenes[0]", "'heightmap' is missing"},
      {"heightmap_name", scene(R"({"heightmap": "rokcs", "views": "top"})"), 4, "scenes[0].heightmap",
       "there is no file rokcs"},
      {"heightmap_source", scene(R"({"heightmap": {"invert": true}, "views": "top"})"), 4, "scenes[0].heightmap",
       "'source' is missing"},
      {"channel", scene(R"({"heightmap": {"source": "rocks", "channel": "x"}, "views": "top"})"), 4,
       "scenes[0].heightmap.channel", "known: auto, r, g, b, a, luminance"},
      {"channel_type", scene(R"({"heightmap": {"source": "rocks", "channel": 1}, "views": "top"})"), 4,
       "scenes[0].heightmap.channel", "expected a string, not number"},
      {"invert", scene(R"({"heightmap": {"source": "rocks", "invert": 1}, "views": "top"})"), 4,
       "scenes[0].heightmap.invert", "expected true or false, not number"},
      {"size_of_image", scene(R"({"heightmap": {"source": "rocks", "width": 64}, "views": "top"})"), 4,
       "scenes[0].heightmap.width", "only a procedural heightmap"},
      {"channel_of_procedural", scene(R"({"heightmap": {"source": "fbm", "channel": "r"}, "views": "top"})"), 4,
       "scenes[0].heightmap.channel", "has no channels"},
      {"side", scene(R"({"heightmap": {"source": "fbm", "width": 1}, "views": "top"})"), 4, "scenes[0].heightmap.width",
       "1 is out of range (expected 2 to 16384)"},
      {"bad_name", scene(R"({"heightmap": {"source": "fbm", "name": "a b"}, "views": "top"})"), 4,
       "scenes[0].heightmap.name", "letters, digits"},
      {"same_scene", scene(fmt::format("{},\n{}", kSceneJson, kSceneJson)), 5, "scenes[1]",
       "a second scene 'rocks/top'"},
      {"same_name", scene(R"({"heightmap": "rocks", "views": "top"},
                             {"heightmap": {"source": "rocks", "invert": true}, "views": "oblique"})"),
       5, "scenes[1]", "another heightmap is called 'rocks'"},
      // measure, front, budgets
      {"measure_key", more("\"measure\": {\"sample\": 3}"), 3, "measure.sample", "did you mean 'samples'?"},
      {"samples", more("\"measure\": {\"samples\": 0}"), 3, "measure.samples", "0 is out of range"},
      {"batch", more("\"measure\": {\"batch_ms\": 0}"), 3, "measure.batch_ms", "0 is out of range"},
      {"long_batch", more("\"measure\": {\"batch_ms\": 1e300}"), 3, "measure.batch_ms", "1e+300 is out of range"},
      {"late_batch", more("\"measure\": {\"batch_ms\": 30000}"), 3, "measure.batch_ms",
       "a batch of 30000 ms is not done within timeout_s, which is 20"},
      {"timeout", more("\"measure\": {\"timeout_s\": \"1\"}"), 3, "measure.timeout_s", "expected a number above 0"},
      {"front_error", more("\"front\": {\"error\": \"e_xyz\"}"), 3, "front.error", "e_xyz"},
      {"front_psnr", more("\"front\": {\"error\": \"psnr\"}"), 3, "front.error", "higher is better"},
      {"constraint", more("\"front\": {\"constraints\": [\"missed_rate\"]}"), 3, "front.constraints[0]", "is no bound"},
      {"budget_metric", more("\"budgets\": [\"e_xy.p99<=1\",\n\"speed<=1\"]"), 4, "budgets[1]", "speed"},
      {"budget_side", more("\"budgets\": \"e_xy.p99>=1\""), 3, "budgets", "its bound is '<='"},
      {"budget_number", more("\"budgets\": \"e_xy.p99<=1x\""), 3, "budgets", "'1x' is not a number"},
      {"budget_nan", more("\"budgets\": \"e_xy.p99<=nan\""), 3, "budgets", "'nan' is not a number"},
      // sweeps
      {"no_technique", sweep("{}"), 5, "sweeps[0]", "'technique' is missing"},
      {"technique", sweep(R"({"technique": "releif"})"), 5, "sweeps[0].technique",
       "'releif' is unknown (did you mean 'relief'?; known: flat, parallax"},
      {"combine", sweep(R"({"technique": "relief", "combine": "zipp"})"), 5, "sweeps[0].combine",
       "did you mean 'zip'?"},
      {"axes_type", sweep(R"({"technique": "relief", "axes": []})"), 5, "sweeps[0].axes", "expected an object"},
      {"param", sweep("{\"technique\": \"relief\",\n\"axes\": {\n\"linear_stepz\": [8]}}"), 7,
       "sweeps[0].axes.linear_stepz", "unknown (did you mean 'linear_steps'?; known: linear_steps, steps_by"},
      {"param_of_flat", sweep(R"({"technique": "flat", "axes": {"format": "r8"}})"), 5, "sweeps[0].axes.format",
       "unknown (known: dispatch, normals)"},
      {"empty_axis", sweep(R"({"technique": "relief", "axes": {"linear_steps": []}})"), 5,
       "sweeps[0].axes.linear_steps", "the list is empty"},
      {"value_range", sweep("{\"technique\": \"relief\", \"axes\": {\"linear_steps\": [8,\n4097\n]}}"), 6,
       "sweeps[0].axes.linear_steps[1]", "4097 is out of range (expected 1 to 4096)"},
      {"value_type", sweep(R"({"technique": "relief", "axes": {"linear_steps": ["8"]}})"), 5,
       "sweeps[0].axes.linear_steps[0]", "expected an integer from 1 to 4096, not string"},
      {"choice", sweep(R"({"technique": "relief", "axes": {"refinement": ["binry"]}})"), 5,
       "sweeps[0].axes.refinement[0]", "did you mean 'binary'?; known: none, secant, binary"},
      {"choice_type", sweep(R"({"technique": "relief", "axes": {"refinement": true}})"), 5, "sweeps[0].axes.refinement",
       "expected a string, not boolean"},
      {"range_choice", sweep(R"({"technique": "relief", "axes": {"format": {"from": 1, "to": 2, "step": 1}}})"), 5,
       "sweeps[0].axes.format", "named values, no range"},
      {"range_both", sweep(R"({"technique": "relief", "axes": {"linear_steps": {"from": 1, "to": 2}}})"), 5,
       "sweeps[0].axes.linear_steps", "either 'times' or 'step'"},
      {"range_order", sweep(R"({"technique": "relief", "axes": {"linear_steps": {"from": 9, "to": 8, "step": 1}}})"), 5,
       "sweeps[0].axes.linear_steps.to", "8 is out of range (expected 9 to 4096)"},
      {"range_times", sweep(R"({"technique": "relief", "axes": {"binary_steps": {"from": 0, "to": 8, "times": 2}}})"),
       5, "sweeps[0].axes.binary_steps.from", "starts at 1 or more"},
      {"range_step", sweep(R"({"technique": "relief", "axes": {"binary_steps": {"from": 0, "to": 8, "step": 0}}})"), 5,
       "sweeps[0].axes.binary_steps.step", "0 is out of range"},
      {"range_key", sweep(R"({"technique": "relief", "axes": {"binary_steps": {"form": 0}}})"), 5,
       "sweeps[0].axes.binary_steps.form", "did you mean 'from'?"},
      {"tuple", sweep(R"({"technique": "relief", "axes": {"linear_steps,binary_steps": [[8, 5], [8]]}})"), 5,
       "sweeps[0].axes.linear_steps,binary_steps[1]", "expected a list of 2 values: linear_steps, binary_steps"},
      {"two_axes",
       sweep(R"({"technique": "relief", "axes": {"linear_steps,binary_steps": [[8, 5]], "binary_steps": [1]}})"), 5,
       "sweeps[0].axes.binary_steps", "parameter 'binary_steps' is in two axes"},
      {"link_twice", sweep(R"({"technique": "relief", "axes": {"linear_steps, linear_steps": [[8, 5]]}})"), 5,
       "sweeps[0].axes.linear_steps, linear_steps", "is in two axes"},
      {"zip", sweep(R"({"technique": "relief", "combine": "zip", "axes": {"linear_steps": [8, 16], "format": "r8",
                 "binary_steps": [1, 2, 3]}})"),
       6, "sweeps[0].axes.binary_steps", "has 3 values, an axis before it 2"},
      {"rule_key", sweep(R"({"technique": "relief", "where": [{"when": {}, "then": {}}]})"), 5,
       "sweeps[0].where[0].when", "known: if, then)"},
      {"rule_then", sweep(R"({"technique": "relief", "where": [{"if": {}}]})"), 5, "sweeps[0].where[0]",
       "'then' is missing"},
      {"rule_param", sweep(R"({"technique": "relief", "where": [{"if": {"frmat": "r8"}, "then": {}}]})"), 5,
       "sweeps[0].where[0].if.frmat", "did you mean 'format'?"},
      {"rule_value", sweep(R"({"technique": "relief", "where": [{"if": {}, "then": {"format": ["r9"]}}]})"), 5,
       "sweeps[0].where[0].then.format[0]", "'r9' is unknown"},
  };
}

class ConfigErrors : public ::testing::TestWithParam<Broken> {};

TEST_P(ConfigErrors, NameLineAndKey) {
  const Broken& broken = GetParam();
  const std::string where = broken.key.empty() ? fmt::format("c.json:{}: ", broken.line)
                                               : fmt::format("c.json:{}: key '{}': ", broken.line, broken.key);
  EXPECT_THAT(config_error(broken.text), AllOf(StartsWith(where), HasSubstr(broken.what)));
}

INSTANTIATE_TEST_SUITE_P(Config, ConfigErrors, ::testing::ValuesIn(broken_configs()),
                         [](const auto& broken) { return broken.param.name; });

// Wherever the text breaks off or a byte is wrong, there is an Error or a config: never another exception.
TEST(Config, EveryTruncationIsAnErrorWithALine) {
  const std::string whole = config_with(kSceneJson, R"({"technique": "relief", "axes": {"linear_steps": [8, 16]}})");
  const std::size_t end = whole.rfind('}');
  for (std::size_t length = 0; length < end; ++length)
    EXPECT_THAT(config_error(whole.substr(0, length)), StartsWith("c.json:")) << length;
}

TEST(Config, EveryWrongByteIsAnErrorOrAConfig) {
  const std::string whole = config_with(kSceneJson, R"({"technique": "relief", "axes": {"linear_steps": [8, 16]}})");
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const char wrong : {'\0', '"', '}', '0', '\xff', '/', '\n'}) {
      std::string text = whole;
      text[i] = wrong;
      EXPECT_THAT(config_error(text), testing::AnyOf("no error", StartsWith("c.json:"))) << i;
    }
}

TEST(Config, SizesAndNamesTellHeightmapsApart) {
  const Config config = parsed_config(config_with(
      R"({"heightmap": "fbm", "views": "top"}, {"heightmap": {"source": "fbm", "width": 64, "height": 32}, "views": "top"},
         {"heightmap": {"source": "fbm", "seed": 2, "name": "second"}, "views": "top"})",
      kSweep));
  ASSERT_EQ(config.scenes.size(), 3U);
  EXPECT_EQ(config.scenes[1].id, "fbm_64x32/top");
  EXPECT_EQ(config.scenes[2].id, "second/top");
}

TEST(Config, ImageFilesAreFoundBesideTheConfig) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "config_test_images";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "my map.png") << "not read here";
  std::ofstream(folder / "c.json") << config_with(
      R"({"heightmap": {"source": "my map.png", "name": "mine"}, "views": "top"})", kSweep);
  const Config config = load_config(folder / "c.json");
  EXPECT_EQ(config.scenes[0].id, "mine/top");
  EXPECT_EQ(config.scenes[0].heightmap.source, (folder / "my map.png").string());
  EXPECT_THAT(
      [&] {
        return parse_config(config_with(R"({"heightmap": "my map.png", "views": "top"})", kSweep), folder / "d.json");
      },
      testing::ThrowsMessage<Error>(HasSubstr("give a \"name\"")));
}

TEST(Config, AMissingFileIsBadInput) {
  try {
    (void)load_config("/nowhere/at/all.json");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), StartsWith("/nowhere/at/all.json: cannot be read"));
  }
  EXPECT_THROW((void)load_config(testing::TempDir()), Error);
}

TEST(Config, BudgetsRoundTrip) {
  for (const std::string_view text : {"e_xy.p99<=0.5", "missed_rate<=1e-05", "psnr>=40", "e_z.max<=0"})
    EXPECT_EQ(parse_budget(text).text(), text);
  for (const std::string_view text : {"", "<=1", "e_xy.p99<=", "e_xy.p99<1", "e_xy.p99<=inf", "e_xy.p99<=0.5 0"})
    EXPECT_THROW((void)parse_budget(text), Error) << text;
}

}  // namespace
}  // namespace reliefbench
