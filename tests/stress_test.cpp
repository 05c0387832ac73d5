#include "tuner/measure/stress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/maps/texel.h"
#include "kernels/trace/surface.h"
#include "reports/pages/stress_page.h"
#include "tests/schema.h"
#include "tests/technique_rig.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

/// A file of extremes with one entry, whose scene is a small plane of spikes.
std::string extremes_text(const std::string& rest, const std::string& settings = "{\"filter\": \"manual\"}") {
  return "{\"frame_px\": [9, 7], \"settings\": " + settings +
         ",\n\"extremes\": [\n{\"id\": \"one\", \"about\": \"a test\",\n"
         "\"scene\": {\"heightmap\": {\"source\": \"spikes\", \"width\": 16, \"height\": 16}, \"views\": \"oblique\"}" +
         rest + "}]}";
}

std::string extremes_refusal(const std::string& text) {
  try {
    (void)parse_extremes(text, "x.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(Extremes, TheBuiltInOnesAreReadAndTouchEveryTechnique) {
  const Extremes extremes = built_in_extremes();
  EXPECT_GE(extremes.list.size(), 20U);
  for (const Technique& technique : techniques())
    for (const Extreme& extreme : extremes.list) {
      // Planes that are drawn are parallel to a plane; what traces solids needs one.
      const bool is_drawn = (technique.passes.empty() || !is_curved(extreme.scene.scene.surface.kind)) &&
                            (!technique.is_of_solids() || is_solid(extreme.scene.heightmap));
      EXPECT_EQ(stress_settings(technique, extremes.changes, extreme).empty(), !is_drawn)
          << technique.id << " at " << extreme.id;
    }
}

TEST(Extremes, RefusalsNameTheLineAndTheKey) {
  EXPECT_EQ(parse_extremes(extremes_text(""), "x.json").list.size(), 1U);
  EXPECT_THAT(extremes_refusal(extremes_text(", \"lagre\": true")), HasSubstr("x.json:4"));
  EXPECT_THAT(extremes_refusal(extremes_text(", \"settings\": {\"stepz\": 3}")), HasSubstr("stepz"));
  EXPECT_THAT(
      extremes_refusal(extremes_text("}, {\"id\": \"one\", \"about\": \"again\", \"scene\": {\"heightmap\": \"fbm\", "
                                     "\"views\": \"top\"}")),
      HasSubstr("a second extreme 'one'"));
  EXPECT_THAT(extremes_refusal("{\"extremes\": []}"), HasSubstr("frame_px"));
}

TEST(Extremes, StepsStandForEveryCountAndAreBroughtIntoRange) {
  Settings settings(find_technique("relief"));
  apply({{"steps", "0"}, {"cone_steps", "7"}, {"refinement", "secant"}, {"loop", "fixed"}}, settings);
  EXPECT_EQ(settings.get("linear_steps"), 1);
  EXPECT_EQ(settings.get("secant_steps"), 0);
  EXPECT_EQ(settings.choice("loop"), "fixed");
  EXPECT_EQ(step_cap(settings), 1);
  apply({{"steps", "4096"}}, settings);
  EXPECT_EQ(step_cap(settings), 4096 + 32);
}

TEST(Extremes, EveryMapFormatAndEncodingThatMakesSenseIsTriedOnce) {
  const Technique& cone = find_technique("cone");
  const std::vector<Settings> list = stress_settings(cone, {}, {});
  std::set<std::string> texts;
  for (const Settings& settings : list) {
    EXPECT_EQ(conflict(settings), "");
    EXPECT_TRUE(texts.insert(settings.text()).second);
  }
  for (const std::string_view id : {"map", "format", "encoding", "correction"}) {
    const Param& param = *cone.find(id);
    for (int value = param.min; value <= param.max; ++value) {
      Settings only(cone);
      only.set(id, value);
      if (!conflict(only).empty()) continue;
      EXPECT_TRUE(std::ranges::any_of(list, [&](const Settings& s) { return s.get(id) == value; }))
          << id << "=" << param.text(value);
    }
  }
}

TEST(Extremes, EveryWayToMarchIsTriedOnce) {
  const auto has = [](std::string_view technique, const std::vector<SettingChange>& choices) {
    return std::ranges::any_of(stress_settings(find_technique(technique), {}, {}), [&](const Settings& settings) {
      return std::ranges::all_of(choices,
                                 [&](const SettingChange& one) { return settings.choice(one.first) == one.second; });
    });
  };
  for (const char* technique : {"sector_cone", "sector_relaxed"})
    for (const char* sectors : {"4", "8", "16"}) EXPECT_TRUE(has(technique, {{"sectors", sectors}})) << technique;
  for (const char* steps_by : {"count", "view", "slope", "length"})
    EXPECT_TRUE(has("relief", {{"steps_by", steps_by}})) << steps_by;
  for (const char* dither : {"pixel", "temporal"}) EXPECT_TRUE(has("relief", {{"dither", dither}})) << dither;
  for (const char* technique : {"cone", "quad_cone"})
    for (const char* factor : {"1_3", "auto"})
      EXPECT_TRUE(has(technique, {{"over_relaxation", factor}, {"step", "plain"}})) << technique;
  for (const char* step : {"plain", "cell_quad"})
    EXPECT_TRUE(has("sector_cone", {{"ratios_a_texel", "2"}, {"over_relaxation", "auto"}, {"step", step}})) << step;
  for (const Technique& technique : techniques())
    if (technique.passes.empty() && !technique.is_of_solids())
      EXPECT_TRUE(has(technique.id, {{"dispatch", "compute"}})) << technique.id;
}

TEST(RandomExtremes, ASceneDependsOnSeedAndIndexAlone) {
  const auto texts = [](int count, std::uint64_t seed) {
    std::vector<std::string> all;
    for (const Extreme& extreme : random_extremes(count, seed).list) all.push_back(extreme.id + extreme.about);
    return all;
  };
  const std::vector<std::string> all = texts(12, 7);
  const std::vector<std::string> first = texts(5, 7);
  EXPECT_TRUE(std::ranges::equal(first, std::span(all).first(5)));
  EXPECT_EQ(std::set(all.begin(), all.end()).size(), 12U);
  EXPECT_NE(texts(1, 8).front().substr(3), all.front().substr(3));
  EXPECT_NE(texts(1, (1ULL << 32U) + 7).front().substr(12), all.front().substr(3)) << "all bits of the seed count";
}

TEST(RandomExtremes, TheyReachEveryKindOfScene) {
  const Extremes extremes = random_extremes(300, 1);
  EXPECT_EQ(extremes.changes, built_in_extremes().changes);
  std::set<SurfaceKind> kinds;
  std::set<std::string> sources;
  int clamped = 0;
  int based = 0;
  int changed = 0;
  for (const auto& [id, about, spec, changes, is_large] : extremes.list) {
    kinds.insert(spec.scene.surface.kind);
    sources.insert(spec.heightmap.source);
    clamped += spec.scene.wrap == Wrap::clamp ? 1 : 0;
    based += spec.scene.base != 1 ? 1 : 0;
    changed += changes.empty() ? 0 : 1;
    // What an extreme is about is its scene, as a file of extremes takes it.
    const std::string again =
        R"({"frame_px": [45, 45], "extremes": [{"id": "a", "about": "b", "scene": )" + about + "}]}";
    EXPECT_EQ(parse_extremes(again, "x.json").list.at(0).scene.id, spec.id);
  }
  EXPECT_EQ(kinds.size(), surfaces().size());
  EXPECT_EQ(sources.size(), procedurals().size());
  for (const int count : {clamped, based, changed}) {
    EXPECT_GT(count, 30);
    EXPECT_LT(count, 270);
  }
}

using StressOnDevices = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, StressOnDevices, ::testing::Values("opengl", "vulkan"), backend_name);

TEST_P(StressOnDevices, every_technique_holds_in_a_small_scene) {
  const Extremes extremes = parse_extremes(extremes_text(""), "x.json");
  const DeviceInfo device = row().devices().front();
  // One text runs on both APIs: each tries every other technique, unless told to be thorough.
  const std::size_t every = static_cast<std::size_t>(tried(2, 1, 2));
  for (std::size_t at = row().id == "opengl" ? 0 : every - 1; at < techniques().size(); at += every) {
    const Technique& technique = techniques()[at];
    if (technique.is_of_solids()) continue;
    const StressReport report = run_stress(
        extremes, {.backends = {std::string(row().id)}, .filter = std::string(technique.id) + "/*", .quiet = true});
    EXPECT_FALSE(report.results.empty()) << technique.id;
    EXPECT_EQ(report.pictures.size(), 1U) << technique.id;
    for (const StressResult& result : report.results) {
      EXPECT_TRUE(result.holds()) << result.technique << "?" << result.settings;
      if (!result.format.empty() && !device.takes(find_format(result.format).type)) {
        EXPECT_THAT(result.skipped, HasSubstr("takes no textures of"));
        continue;
      }
      EXPECT_EQ(result.skipped, "");
      EXPECT_GT(result.pixels, 0);
    }
  }
}

TEST_P(StressOnDevices, techniques_of_solids_hold_on_a_solid_and_run_on_nothing_else) {
  const Extremes extremes = parse_extremes(extremes_text("}, {\"id\": \"two\", \"about\": \"a solid\", \"scene\": "
                                                         "{\"heightmap\": {\"source\": \"specks\", \"width\": 16, "
                                                         "\"height\": 16}, \"views\": \"oblique\"}"),
                                           "x.json");
  const StressReport report =
      run_stress(extremes, {.backends = {std::string(row().id)}, .filter = "double_*", .quiet = true});
  EXPECT_GT(report.results.size(), 10U);
  for (const StressResult& result : report.results) {
    EXPECT_EQ(result.extreme, "two");
    EXPECT_EQ(result.skipped, "");
    EXPECT_TRUE(result.holds()) << result.technique << "?" << result.settings;
  }
}

// That a check can fail: the null device's hits stop short of the surface, whatever the technique promises.
TEST(Stress, FindsABrokenGuarantee) {
  Extremes extremes = parse_extremes(extremes_text("", R"({"filter": "manual", "cone_steps": 0})"), "x.json");
  extremes.list.at(0).scene.scene.relief_depth = 10;
  const StressReport report = run_stress(extremes, {.backends = {"null"}, .filter = "cone/*", .quiet = true});
  EXPECT_FALSE(report.holds());
  const bool is_guarantee = std::ranges::any_of(
      report.results, [](const StressResult& result) { return result.fault(StressCheck::guarantee) > 0; });
  EXPECT_TRUE(is_guarantee);
}

// The last bits of a place a thousand tiles round a sphere are whole hundredths of a texel.
TEST(Stress, BackendsAgreeOnRaysThatFloatsHardlyTellApart) {
  const StressReport report = run_stress(
      built_in_extremes(), {.backends = {"opengl", "vulkan"}, .filter = "distance/*/sphere_tiled", .quiet = true});
  EXPECT_EQ(report.extremes.size(), 1U);
  EXPECT_TRUE(report.holds());
}

TEST(Stress, FindsBackendsThatDoNotAgree) {
  const Extremes extremes = parse_extremes(extremes_text("", R"({"filter": "manual", "cone_steps": 1})"), "x.json");
  const StressReport report = run_stress(extremes, {.backends = {"null", "opengl"}, .filter = "cone/*", .quiet = true});
  EXPECT_THAT(report.techniques, ::testing::ElementsAre("cone"));
  EXPECT_TRUE(std::ranges::any_of(report.results,
                                  [](const StressResult& result) { return result.fault(StressCheck::agreement) > 0; }));
}

TEST(Stress, LargeExtremesAreLeftOutUnlessAskedFor) {
  const Extremes extremes = parse_extremes(extremes_text(", \"large\": true"), "x.json");
  StressOptions options{.backends = {"null"}, .filter = "flat/*", .quiet = true};
  EXPECT_THAT(run_stress(extremes, options).results.at(0).skipped, HasSubstr("--large"));
  options.is_large = true;
  EXPECT_EQ(run_stress(extremes, options).results.at(0).skipped, "");
}

// Bakers that would take days there are left out of large maps, with the reason.
TEST(Stress, LargeExtremesLeaveOutWhatTakesDays) {
  const Extremes extremes = parse_extremes(extremes_text(", \"large\": true"), "x.json");
  const StressOptions options{.backends = {"null"}, .filter = "*cone/*", .is_large = true, .quiet = true};
  int left_out = 0;
  for (const StressResult& result : run_stress(extremes, options).results) {
    const bool is_slow = result.map == "relaxed_po07";
    EXPECT_EQ(result.settings.find("=certified"), std::string::npos);
    EXPECT_EQ(!result.skipped.empty(), is_slow) << result.technique << "?" << result.settings;
    left_out += is_slow ? 1 : 0;
  }
  EXPECT_GT(left_out, 0);
}

TEST(Stress, AFilterThatMatchesNothingIsRefused) {
  const Extremes extremes = parse_extremes(extremes_text(""), "x.json");
  EXPECT_THROW((void)run_stress(extremes, {.backends = {"null"}, .filter = "bump/*", .quiet = true}), Error);
}

TEST(Stress, FaultsAreToldAsTheyCome) {
  Extremes extremes = parse_extremes(extremes_text("", R"({"filter": "manual", "cone_steps": 0})"), "x.json");
  extremes.list.at(0).scene.scene.relief_depth = 10;
  std::vector<std::string> told;
  const StressReport report = run_stress(extremes, {.backends = {"null"},
                                                    .filter = "cone/*",
                                                    .quiet = true,
                                                    .words =
                                                        [&](const StressResult& result) {
                                                          told.push_back(result.settings);
                                                          return std::string();
                                                        },
                                                    .is_interrupted = [&] { return told.size() == 2; }});
  std::vector<std::string> failing;
  for (const StressResult& result : report.results)
    if (!result.holds()) failing.push_back(result.settings);
  EXPECT_EQ(told.size(), 2U) << "it went on until the second one";
  EXPECT_EQ(told, failing);
  EXPECT_GT(report.undone, 0);
}

TEST(Stress, AnInterruptedRunSaysWhatItDidNotComeTo) {
  const Extremes extremes = parse_extremes(extremes_text(""), "x.json");
  StressOptions options{.backends = {"null"}, .filter = "flat/*", .quiet = true};
  const StressReport whole = run_stress(extremes, options);
  EXPECT_TRUE(whole.holds());
  EXPECT_EQ(whole.undone, 0);
  EXPECT_FALSE(stress_json(whole).contains("undone"));
  options.is_interrupted = [asked = 0]() mutable { return ++asked > 1; };
  options.filter = "relief/*";
  const StressReport report = run_stress(extremes, options);
  EXPECT_EQ(report.results.size(), 1U);
  EXPECT_GT(report.undone, 1);
  EXPECT_FALSE(report.holds()) << "what was not drawn is not known to hold";
  const nlohmann::json data = stress_json(report);
  EXPECT_EQ(data["undone"], report.undone);
  EXPECT_EQ(schema_errors(data, "stress"), "");
}

TEST(Stress, ReportsAreWrittenWhole) {
  const Extremes extremes = parse_extremes(extremes_text(""), "x.json");
  const StressReport report = run_stress(extremes, {.backends = {"null"}, .filter = "relief/*", .quiet = true});
  const TempFolder folder;
  const FolderLock lock = prepare_stress_folder(folder.path() / "stress");
  EXPECT_THAT([&] { (void)prepare_stress_folder(folder.path() / "stress"); },
              ::testing::ThrowsMessage<Error>(HasSubstr("stress: another process is writing to it")));
  write_stress(report, folder.path() / "stress");
  const auto data = nlohmann::json::parse(read_file(folder.path() / "stress" / "stress.json"));
  EXPECT_EQ(data["results"].size(), report.results.size());
  EXPECT_EQ(schema_errors(data, "stress"), "");
  const std::string page = read_file(folder.path() / "stress" / "stress.html");
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, ::testing::Not(HasSubstr("{{")));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "stress" / "images" / "relief.png"));
}

}  // namespace
}  // namespace reliefbench
