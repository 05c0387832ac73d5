// A scene is what it holds, not what it is called.
#include "tuner/plan/scene_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/error.h"
#include "tests/temp_folder.h"
#include "tests/test_heightmap.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/run_info.h"
#include "tuner/plan/config_json.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/stages.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(SceneKey, changes_with_everything_that_a_scene_is_and_not_with_its_name) {
  const Scene plain;
  const std::vector<std::function<void(Scene&)>> changes = {
      [](Scene& s) { s.relief_depth = 0.25; },
      [](Scene& s) { s.tiling = 2; },
      [](Scene& s) { s.pan = 0.5; },
      [](Scene& s) { s.base = 0.5; },
      [](Scene& s) { s.wrap = Wrap::clamp; },
      [](Scene& s) { s.width_px = 128; },
      [](Scene& s) { s.height_px = 128; },
      [](Scene& s) { s.view.elevation_deg = 31; },
      [](Scene& s) { s.view.distance = 2; },
      [](Scene& s) { s.view.fov_deg = 46; },
      [](Scene& s) { s.view.azimuth_deg = 1; },
      [](Scene& s) { s.light.elevation_deg = 20; },
      [](Scene& s) { s.light.azimuth_deg = 20; },
      [](Scene& s) { s.light.angular_radius_deg = 1; },
      [](Scene& s) { s.reference = Picture::supersampled; },
      [](Scene& s) { s.surface.kind = SurfaceKind::sphere; },
      [](Scene& s) { s.surface.kind = SurfaceKind::torus; },
      [](Scene& s) { s.surface = {.kind = SurfaceKind::torus, .tube = 0.5}; },
      [](Scene& s) { s.surface = {.kind = SurfaceKind::sphere, .round = 5}; },
      [](Scene& s) { s.surface.kind = SurfaceKind::mesh; },
      [](Scene& s) { s.surface = {.kind = SurfaceKind::mesh, .sha256 = "aa"}; }};
  std::set<SceneKey> keys = {scene_key("aa", plain), scene_key("bb", plain)};
  for (const auto& change : changes) {
    Scene scene = plain;
    change(scene);
    keys.insert(scene_key("aa", scene));
  }
  EXPECT_EQ(keys.size(), changes.size() + 2);
  Scene renamed = plain;
  renamed.view.id = "from the side";
  EXPECT_EQ(scene_key("aa", renamed), scene_key("aa", plain));
  Scene zero = plain;
  zero.pan = -0.0;
  EXPECT_EQ(scene_key("aa", zero), scene_key("aa", plain));
  EXPECT_EQ(scene_key("aa", plain).hex.size(), 64U);
}

// So that keys of before there was another light stay.
TEST(SceneKey, does_not_have_the_usual_light) {
  EXPECT_EQ(scene_key("aa", Scene{}).short_text(), "c6a9f773");
  const FrameUniforms frame = frame_uniforms(Scene{}, 8, 8);
  EXPECT_EQ(frame.light, (std::array{-0.48F, 0.36F, 0.8F, 0.0F}));
  EXPECT_EQ(frame_uniforms({.view = {}, .light = {.elevation_deg = 90}}, 8, 8).light,
            (std::array{0.0F, 0.0F, 1.0F, 0.0F}));
}

TEST(SceneKey, of_heights_as_they_are_read) {
  const TempFolder folder;
  write_heightmap(folder / "a.pgm", 1);
  write_heightmap(folder / "copy.pgm", 1);
  write_heightmap(folder / "b.pgm", 2);
  Heightmaps heightmaps;
  const auto hash = [&](const std::string& name, bool invert = false, bool normalise = false) {
    return heightmaps.read({.source = folder / name, .invert = invert, .normalise = normalise}).sha256;
  };
  EXPECT_EQ(hash("a.pgm"), hash("copy.pgm"));
  EXPECT_EQ(
      (std::set<std::string>{hash("a.pgm"), hash("b.pgm"), hash("a.pgm", true), hash("a.pgm", false, true)}.size()),
      4U);
  const std::vector<float> texels(16, 0.5F);
  EXPECT_NE(heights_sha256({.width = 4, .height = 4, .texels = texels}),
            heights_sha256({.width = 2, .height = 8, .texels = texels}));
}

TEST(Heightmaps, read_each_file_once) {
  const TempFolder folder;
  write_heightmap(folder / "a.pgm", 1);
  Heightmaps heightmaps;
  const std::vector<float> before = heightmaps.read({.source = folder / "a.pgm"}).field.texels;
  write_heightmap(folder / "a.pgm", 2);
  EXPECT_EQ(heightmaps.read({.source = folder / "a.pgm"}).field.texels, before);
  EXPECT_NE(Heightmaps().read({.source = folder / "a.pgm"}).field.texels, before);
}

TEST(SceneJson, is_the_whole_scene_and_keeps_its_key) {
  const SceneSpec spec{
      .id = "deep/mine",
      .heightmap =
          {.source = "fbm", .channel = "g", .invert = true, .normalise = true, .width = 32, .height = 16, .seed = 7},
      .scene = {.view = {.id = "mine", .elevation_deg = 12.5, .distance = 0.1, .fov_deg = 33, .azimuth_deg = -4},
                .relief_depth = 0.3,
                .tiling = 2.5,
                .pan = 0.1,
                .wrap = Wrap::clamp,
                .width_px = 48,
                .height_px = 32,
                .light = {.elevation_deg = 20, .azimuth_deg = -100, .angular_radius_deg = 0.25},
                .reference = Picture::supersampled,
                .occluded = 0.5,
                .surface = {.kind = SurfaceKind::torus, .round = 6, .tube = 2}}};
  const MeasuredScene scene = measured_scene(spec, Heightmaps().read(spec.heightmap));
  const nlohmann::json j = scene_json(scene);
  const MeasuredScene back = parse_scene(nlohmann::json::parse(j.dump()));
  EXPECT_EQ(back.key, scene.key);
  EXPECT_EQ(back.heights_sha256, scene.heights_sha256);
  EXPECT_EQ(back.spec.id, "deep/mine");
  EXPECT_EQ(back.spec.scene.view, spec.scene.view);
  EXPECT_EQ(back.spec.scene.light, spec.scene.light);
  EXPECT_EQ(back.spec.scene.surface, spec.scene.surface);
  EXPECT_EQ(back.map_width, 32);
  EXPECT_EQ(back.map_height, 16);
  EXPECT_EQ(scene_json(back), j);
  EXPECT_EQ(Heightmaps().read(back.spec.heightmap).sha256, scene.heights_sha256);
  const auto refused = [&](const char* pointer, const nlohmann::json& value, const std::string& words) {
    nlohmann::json bad = j;
    bad[nlohmann::json::json_pointer(pointer)] = value;
    EXPECT_THAT([&] { (void)parse_scene(bad); }, ThrowsMessage<Error>(HasSubstr(words))) << bad;
  };
  refused("/relief_depth", 0.4, "but what it says makes");
  refused("/relief_depth", "deep", "'relief_depth'");
  refused("/light/elevation_deg", 21, "but what it says makes");
  refused("/light", 3, "'elevation_deg'");
  refused("/frame_px", {0, 1}, "'frame_px'");
  refused("/heights_texels", {32, 0}, "'heights_texels'");
  refused("/wrap", "mirror", "'wrap'");
  refused("/reference", "lines", "which is no row of pictures");
  refused("/reference", 5, "'reference'");
  refused("/occluded", "half", "'occluded'");
  refused("/surface/kind", "cube", "'surface'");
  refused("/surface/round", 7, "but what it says makes");
  refused("/surface/tube", "thin", "'tube'");
  refused("/key", "abc", "is no scene key");
  refused("/view", 1, "'id' is missing");
  EXPECT_THROW((void)parse_scene(nlohmann::json::array()), Error);
}

// As re-runs and the viewer write it: of any scene, with a preset's view or one of its own.
TEST(SceneInConfig, is_read_back_as_the_same) {
  View turned = view_presets()[1];
  turned.id = "turned";
  turned.azimuth_deg = 30;
  for (const View& view : {view_presets()[2], turned}) {
    const SceneSpec spec{
        .id = "fbm_32x32/" + view.id,
        .heightmap = {.source = "fbm", .invert = true, .normalise = true, .width = 32, .height = 32, .seed = 7},
        .scene = {.view = view,
                  .relief_depth = 0.2,
                  .tiling = 3,
                  .pan = 0.25,
                  .wrap = Wrap::clamp,
                  .width_px = 40,
                  .height_px = 30,
                  .light = {.elevation_deg = 20, .azimuth_deg = 5, .angular_radius_deg = 1}}};
    const nlohmann::json config = {{"name", "again"},
                                   {"scenes", {config_scene_json(spec)}},
                                   {"sweeps", {config_sweep_json(Settings(find_technique("cone")))}}};
    const Config read = parse_config(config.dump(), "again.json");
    ASSERT_EQ(read.scenes.size(), 1U);
    EXPECT_EQ(heightmap_json(read.scenes[0].heightmap), heightmap_json(spec.heightmap));
    EXPECT_EQ(scene_key("", read.scenes[0].scene), scene_key("", spec.scene)) << config;
  }
}

TEST(StageKeys, know_every_stage_and_every_input) {
  std::set<std::string> ids;
  for (const StageVersion& stage : stage_versions()) EXPECT_TRUE(ids.insert(stage.id).second) << stage.id;
  for (const MapRow& row : map_kinds()) EXPECT_TRUE(ids.contains(bake_stage(row.id))) << row.id;
  for (const char* id : {"encode", "pack", "trace", "reference", "judge", "harness"})
    EXPECT_TRUE(ids.contains(id)) << id;
  const std::set<std::string> keys = {stage_key({"judge"}, {"a", "b"}), stage_key({"judge"}, {"ab"}),
                                      stage_key({"judge"}, {"a", "b", ""}), stage_key({"pack"}, {"a", "b"}),
                                      stage_key({"judge", "pack"}, {"a", "b"})};
  EXPECT_EQ(keys.size(), 5U);
  EXPECT_THROW((void)stage_key({"jugde"}, {}), Error);
}

// What an older build made is then not taken for what this one would make.
TEST(StageKeys, change_with_the_version_of_each_of_their_stages) {
  for (std::size_t i = 0; i < stage_versions().size(); ++i) {
    std::vector<StageVersion> raised = stage_versions();
    ++raised[i].version;
    EXPECT_NE(stage_key({raised[i].id, "harness"}, {"a"}, raised), stage_key({raised[i].id, "harness"}, {"a"}));
    const std::string other = raised[i].id == "judge" ? "pack" : "judge";
    EXPECT_EQ(stage_key({other}, {"a"}, raised), stage_key({other}, {"a"}));
  }
}

TEST(StageKeys, of_cases_name_the_stages_that_make_them) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  WallSplit split;
  Session session(find_backend("null"), 0, split);
  MapLibrary library(cache, split);
  Preparer preparer(
      {.session = session, .library = library, .cache = cache, .split = split, .timeout_s = 60, .flicker_frames = 0});
  const SceneSpec scene{.id = "fbm_16x16/oblique",
                        .heightmap = {.source = "fbm", .width = 16, .height = 16},
                        .scene = {.view = view_presets()[0], .width_px = 16, .height_px = 16}};
  const Case cone{.settings = parse_setting("cone"), .scene_id = scene.id, .backend = "null"};
  const DeviceInfo& device = session.device();
  const auto inputs = [&](const Target& target) {
    return std::array{scene_key(library.loaded(scene).sha256, scene.scene).hex, setting_id(cone.settings),
                      session.pipelines().fragment_sha256(session.source_of(cone.settings, target, scene.scene)),
                      session.sampler_key(cone.settings)};
  };
  const auto key = [&](std::initializer_list<std::string_view> stages, const Target& target) {
    const auto [key_of_scene, setting, shader, sampler] = inputs(target);
    return stage_key(stages, {key_of_scene, setting, shader, sampler, device.backend, device.name, device.driver});
  };
  (void)preparer.score(cone, scene);
  EXPECT_TRUE(std::filesystem::exists(
      cache.file(key({"bake.conservative", "encode", "pack", "trace", "reference", "judge"}, Target::score))));
  const Record record = preparer.prepare(cone, scene).record;
  ASSERT_EQ(record.status, Status::ok) << record.reason;
  EXPECT_EQ(record.timing_key, key({"bake.conservative", "encode", "pack", "trace", "harness"}, Target::color));
  EXPECT_TRUE(std::filesystem::exists(cache.file(record.bake_key)));
  EXPECT_TRUE(std::filesystem::exists(cache.file(record.reference_key)));
}

// A run is not gone on with by a build that bakes, packs, judges, ... otherwise.
TEST(StageKeys, a_runs_identity_has_every_stage) {
  const std::vector<StageVersion> now = stage_versions();
  EXPECT_EQ(kernels_sha256(now), kernels_sha256());
  for (std::size_t i = 0; i < now.size(); ++i) {
    std::vector<StageVersion> raised = now;
    ++raised[i].version;
    EXPECT_NE(kernels_sha256(raised), kernels_sha256()) << now[i].id;
  }
}

}  // namespace
}  // namespace reliefbench
