// What ships: the shader compiles and traces as the technique does, the textures are those that were measured.
#include "reports/export/export.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/image/ktx2.h"
#include "reports/export/glsl_fold.h"
#include "reports/export/shipped_shader.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tests/technique_rig.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

/// Every technique, and what changes which code or textures it needs.
std::vector<std::string> shipped_settings() {
  std::vector<std::string> ids;
  for (const Technique& technique : techniques()) ids.emplace_back(technique.id);
  for (const char* id : {"parallax?variant=plain&filter=manual",
                         "relief?refinement=none&loop=fixed&filter=manual",
                         "relief?refinement=secant&format=r32f",
                         "depth_slices?loop=fixed",
                         "interval?search=cone&format=rg16f",
                         "cone?step=plain&format=rgba8",
                         "cone?correction=min4&step=cell_max&format=r8+r8",
                         "cone?correction=min4&filter=manual&encoding=h_tan",
                         "cone?lod=footprint&encoding=atan",
                         "relaxed_cone?refinement=secant&format=r8+r8&encoding=ratio",
                         "quad_cone?refinement=binary&filter=manual",
                         "safety_shape?loop=fixed&format=r8+rgba8",
                         "qdm?refinement=none",
                         "qdm?refinement=binary&filter=manual",
                         "distance?step=published",
                         "relief?shadow=linear",
                         "relief?shadow=binary",
                         "cone?shadow=cone&format=rgba8",
                         "relaxed_cone?shadow=soft_taps&shadow_bias=1_256",
                         "interval?search=cone&shadow=soft_cone"})
    ids.emplace_back(id);
  return ids;
}

const Heightfield& heights() {
  static const Heightfield map = load_heightmap({.source = "fbm", .width = 32, .height = 32});
  return map;
}

std::string shader_of(const Settings& settings, const StoredMap& map, Wrap wrap) {
  ShippedShader shipped{.settings = settings, .heightmap = "fbm", .wrap = wrap};
  if (settings.technique().reads_map()) shipped.textures = shipped_textures(settings, map.textures);
  return shipped_shader(shipped);
}

TEST(ShippedShader, compiles_in_both_dialects_with_no_more_than_it_needs) {
  for (const std::string& id : shipped_settings())
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      SCOPED_TRACE(id);
      const Settings settings = parse_setting(id);
      const StoredMap map = store_map(settings, heights(), wrap);
      const std::string shader = shader_of(settings, map, wrap);
      for (const char* word : {"#include", "constant_id", "frame.", "reference_map"})
        EXPECT_THAT(shader, Not(HasSubstr(word)));
      const bool has_format = settings.technique().reads_map();
      EXPECT_EQ(shader.find("sampler2D relief_map") != std::string::npos, has_format);
      EXPECT_EQ(shader.find("sampler2D extra_map") != std::string::npos, map.textures.extra.has_value());
      const std::string fragment = "#version 450\n" + shader +
                                   "layout(location = 0) in vec2 uv;\nlayout(location = 1) in vec3 view;\n"
                                   "layout(location = 0) out vec4 color;\n"
                                   "void main() { color = vec4(trace(view_ray(uv, view, 0.1)).t); }\n";
      for (const Dialect dialect : {Dialect::vulkan, Dialect::opengl})
        EXPECT_NO_THROW((void)compile_whole_fragment({.name = id, .text = fragment}, dialect)) << fragment;
    }
}

TEST(ShippedShader, says_on_top_what_it_is_and_how_it_is_called) {
  const Settings settings = parse_setting("cone?lod=footprint&format=rgba8");
  const std::string shader = shader_of(settings, store_map(settings, heights(), Wrap::clamp), Wrap::clamp);
  for (const std::string words :
       {"[DUM06] Dummer: Cone Step Mapping", "cone?cone_steps=32&", "wrap clamp",
        "relief_map, binding 1: relief.ktx2, 32 x 32, 6 levels, R8G8B8A8_UNORM: r = height",
        "Guarantee: never_skips, on a sampler that is off by no more than its steps make up for", "discard",
        "ray.footprint = pixel_footprint(uv);", "Hit hit = trace(ray);"})
    EXPECT_THAT(shader.substr(0, shader.find("\n\n")), HasSubstr(words));
  EXPECT_THAT(shader, Not(HasSubstr("shadow")));
}

TEST(ShippedShader, has_the_shadow_that_its_setting_has) {
  const Settings settings = parse_setting("cone?shadow=cone&shadow_steps=24");
  const std::string shader = shader_of(settings, store_map(settings, heights(), Wrap::repeat), Wrap::repeat);
  for (const std::string words : {"of shadow", "rays: never_skips.", "Scene scene = Scene(light, light_radius, 0.1",
                                  "float shadow = relief_shadow(ray, scene, hit);", "const int SHADOW_STEPS = 24;"})
    EXPECT_THAT(shader, HasSubstr(words));
  EXPECT_THAT(shader, Not(HasSubstr("shade_shadow")));
}

class ShippedShaderOnDevice : public BackendTest {};

/// The trace on rays that a texture holds, into a score frame.
constexpr std::string_view kRaysFromTexture = R"(
#ifdef VULKAN
layout(set = 0, binding = 3) uniform sampler2D rays;
#else
layout(binding = 3) uniform sampler2D rays;
#endif
layout(location = 0) out vec4 out_ray;
layout(location = 1) out vec4 out_hit;
#ifdef WITH_SHADOW
layout(location = 2) out float out_shadow;
#endif
void main() {
  out_ray = texelFetch(rays, ivec2(gl_FragCoord.xy), 0);
  Ray ray = Ray(out_ray.xy, out_ray.zw, 1.0, 1.0, 0);
  Hit hit = trace(ray);
#ifdef WITH_SHADOW
  out_shadow = relief_shadow(ray, Scene(vec3(LIGHT), LIGHT_RADIUS, 0.1), hit);
#endif
  out_hit = vec4(hit.t, float(hit.status), float(hit.taps), float(hit.steps));
}
)";

TEST_P(ShippedShaderOnDevice, finds_the_techniques_hits_to_the_bit) {
  on_every_device([&](const Rig& rig) {
    for (const std::string& id : shipped_settings())
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        const Settings settings = parse_setting(id);
        // These read the view's angle or the pixel's size, which a score frame does not tell.
        if (id == "parallax" || id.find("lod=footprint") != std::string::npos) continue;
        SCOPED_TRACE(id);
        const StoredMap map = store_map(settings, heights(), wrap);
        Scene scene = kScene;
        scene.wrap = wrap;
        scene.light = {.elevation_deg = 20, .angular_radius_deg = 3};
        const std::vector<ScorePixel> expected = trace_frame(rig, settings, map, scene, kShippedSampler);
        const std::vector<PixelFeature> features = pixel_features(settings);
        const FeatureValues expected_values = rig.backend->read_values(features);
        const FrameUniforms frame = frame_uniforms(scene, heights().width, heights().height);
        std::string defines = "#version 450\n";
        if (!features.empty())
          defines +=
              fmt::format("#define WITH_SHADOW\n#define LIGHT {:#.9}, {:#.9}, {:#.9}\n#define LIGHT_RADIUS {:#.9}\n",
                          frame.light[0], frame.light[1], frame.light[2], frame.light[3]);
        std::vector<std::array<float, 4>> rays;
        for (const ScorePixel& pixel : expected)
          rays.push_back({pixel.ray.u, pixel.ray.v, pixel.ray.slope_u, pixel.ray.slope_v});
        const auto ray_texture = rig.backend->upload({.width = scene.width_px,
                                                      .height = scene.height_px,
                                                      .layout = {.type = TexelType::float32, .channels = 4},
                                                      .texels = std::as_bytes(std::span(rays)),
                                                      .wrap = Wrap::clamp,
                                                      .filter = Filter::nearest});
        const std::string fragment = defines + shader_of(settings, map, wrap) + std::string(kRaysFromTexture);
        const auto pipeline = rig.pipeline(compile_whole_fragment({.name = id, .text = fragment}, rig.row.dialect),
                                           score_target(features), {}, "shipped");
        const auto relief = rig.backend->upload(texture_desc(map.textures.relief, wrap));
        const auto extra = map.textures.extra ? rig.backend->upload(texture_desc(*map.textures.extra, wrap)) : nullptr;
        Textures textures = rig.textures(relief.get(), extra.get());
        textures["rays"] = ray_texture.get();
        rig.backend->render({.pipeline = pipeline.get(), .textures = std::move(textures), .frame = frame}, 1,
                            Timer::fenced_wall);
        const std::vector<ScorePixel> found = rig.backend->read_score();
        ASSERT_EQ(found.size(), expected.size());
        const FeatureValues found_values = rig.backend->read_values(features);
        for (std::size_t i = 0; i < features.size() * found.size(); ++i) {
          if (static_cast<PixelStatus>(expected[i].status) == PixelStatus::no_ray) continue;
          ASSERT_EQ(found_values.front()[i], expected_values.front()[i]) << i;
        }
        int differing = 0;
        int traced = 0;
        for (std::size_t i = 0; i < found.size(); ++i) {
          if (static_cast<PixelStatus>(expected[i].status) == PixelStatus::no_ray) continue;
          ++traced;
          differing += std::memcmp(&found[i], &expected[i], sizeof(ScorePixel)) == 0 ? 0 : 1;
        }
        EXPECT_GT(traced, 100);
        EXPECT_EQ(differing, 0) << "of " << traced;
      }
  });
}
INSTANTIATE_TEST_SUITE_P(backends, ShippedShaderOnDevice, ::testing::Values("opengl", "vulkan"), backend_name);

TEST(GlslFold, ifs_that_constants_decide_vanish) {
  const GlslConstants constants = {{"A", 1}, {"ONE", 1}, {"TWO", 2}};
  const auto body = [&](const std::string& text) { return folded("f() {\n" + text + "}\n", constants); };
  const auto kept = [](const std::string& text) { return "f() {\n" + text + "}\n"; };
  EXPECT_EQ(body("  if (A == ONE) x = 1;\n  y;\n"), kept("  x = 1;\n  y;\n"));
  EXPECT_EQ(body("  if (A != ONE) x = 1;\n  y;\n"), kept("  y;\n"));
  EXPECT_EQ(body("  if (A == ONE)\n    x = 1;\n  y;\n"), kept("  x = 1;\n  y;\n"));
  EXPECT_EQ(body("  if (A == TWO)\n    x = 1;\n  y;\n"), kept("  y;\n"));
  EXPECT_EQ(body("  if (A == TWO) {\n    x;\n\n    y;\n  }\n  z;\n"), kept("  z;\n"));
  EXPECT_EQ(body("  if (A == ONE) {\n    x;\n\n    y;\n  } else {  // why\n    v;\n  }\n  z;\n"),
            kept("  x;\n\n  y;\n  z;\n"));
  EXPECT_EQ(body("  if (A == TWO) {\n    x;\n  } else {  // why\n    v;\n  }\n  z;\n"), kept("  v;\n  z;\n"));
  EXPECT_EQ(body("  if (A == ONE && f(x)) y;\n"), kept("  if (f(x)) y;\n"));
  EXPECT_EQ(body("  if (A == TWO && f(x)) y;\n"), kept(""));
  EXPECT_EQ(body("  if (A == TWO || f(x)) {\n    y;\n  }\n"), kept("  if (f(x)) {\n    y;\n  }\n"));
  EXPECT_EQ(body("  if (A == ONE || f(x)) y;\n"), kept("  y;\n"));
  EXPECT_EQ(body("  if (A == ONE) return x;\n  y;\n  return z;\n"), kept("  return x;\n"));
  EXPECT_EQ(body("  if (a == ONE) return x;  // unknown\n  return z;\n"),
            kept("  if (a == ONE) return x;  // unknown\n  return z;\n"));
  EXPECT_EQ(body("  if (x) {\n    if (A == ONE) {\n      if (A == TWO) y;\n      z;\n    }\n  }\n"),
            kept("  if (x) {\n    z;\n  }\n"));
}

const ExportedFile* file_of(const Export& exported, const std::string& name) {
  const auto found = std::ranges::find(exported.files, name, &ExportedFile::name);
  return found == exported.files.end() ? nullptr : &*found;
}

class ExportTest : public ::testing::Test {
 protected:
  ExportTest() { setenv("RELIEFBENCH_CACHE", (folder_ / "cache").c_str(), 1); }
  static ExportJob job(const std::string& id) {
    return {.heightmap = {.source = "fbm", .width = 32, .height = 32}, .settings = parse_setting(id)};
  }
  [[nodiscard]] std::set<std::string> names_in(const std::string& name) const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / name))
      names.insert(entry.path().filename().string());
    return names;
  }
  TempFolder folder_;
};

TEST_F(ExportTest, textures_are_those_that_the_technique_is_measured_with) {
  for (const std::string& id : shipped_settings()) {
    SCOPED_TRACE(id);
    const ExportJob shipped = job(id);
    const Export exported = make_export(shipped);
    EXPECT_EQ(schema_errors(nlohmann::json::parse(exported.files.back().bytes), "export"), "");
    for (std::size_t i = 0; i + 1 < exported.files.size(); ++i)
      EXPECT_EQ(exported.settings["files"][i]["sha256"], sha256(exported.files[i].bytes));
    if (!shipped.settings.technique().reads_map()) {
      EXPECT_EQ(exported.files.size(), 2U);
      continue;
    }
    const StoredMap map = store_map(shipped.settings, heights(), Wrap::repeat);
    const auto expect_same = [&](const std::string& name, const TextureImage& image) {
      const ExportedFile* const file = file_of(exported, name);
      ASSERT_NE(file, nullptr) << name;
      const Ktx2File read = decode_ktx2(std::as_bytes(std::span(file->bytes)), name);
      EXPECT_EQ(read.image.texels, image.texels);
      EXPECT_EQ(read.image.layout, image.layout);
      EXPECT_EQ(read.image.levels, image.levels);
      EXPECT_EQ(read.metadata.at("reliefbench.format"), shipped.settings.choice("format"));
    };
    expect_same("relief.ktx2", map.textures.relief);
    if (map.textures.extra) expect_same("relief.extra.ktx2", *map.textures.extra);
    EXPECT_EQ(file_of(exported, "relief.extra.ktx2") != nullptr, map.textures.extra.has_value());
  }
}

TEST_F(ExportTest, a_later_export_replaces_its_own_files_alone) {
  write_export(make_export(job("max_mip")), folder_ / "a/b");
  EXPECT_EQ(names_in("a/b"),
            (std::set<std::string>{"relief.ktx2", "relief.extra.ktx2", "relief.glsl", "settings.json"}));
  write_atomically(folder_ / "a/b/mine.txt", "mine");
  write_export(make_export(job("relief")), folder_ / "a/b");
  EXPECT_EQ(names_in("a/b"), (std::set<std::string>{"mine.txt", "relief.ktx2", "relief.glsl", "settings.json"}));
}

TEST_F(ExportTest, files_of_somebody_else_stay) {
  const Export exported = make_export(job("max_mip"));
  for (const char* name : {"settings.json", "relief.ktx2", "relief.extra.ktx2", "relief.glsl"}) {
    for (const char* text : {"mine", "{}", R"({"made_by": "me", "files": [{"file": "relief.glsl"}]})"}) {
      write_atomically(folder_ / name, text);
      EXPECT_THAT([&] { write_export(exported, folder_.path()); }, ThrowsMessage<Error>(HasSubstr(name)));
      EXPECT_EQ(file_text(folder_ / name), text);
      std::filesystem::remove(folder_ / name);
    }
  }
  // An earlier export's settings.json says which files are its own.
  write_export(make_export(job("relief")), folder_ / "out");
  write_atomically(folder_ / "out/relief.extra.ktx2", "mine");
  write_export(make_export(job("relief")), folder_ / "out");
  EXPECT_EQ(file_text(folder_ / "out/relief.extra.ktx2"), "mine");
  EXPECT_THROW(write_export(exported, folder_ / "out"), Error);
  EXPECT_EQ(file_text(folder_ / "out/relief.extra.ktx2"), "mine");
}

TEST_F(ExportTest, a_link_is_not_followed) {
  write_atomically(folder_ / "mine", "mine");
  std::filesystem::create_directories(folder_ / "out");
  std::filesystem::create_symlink(folder_ / "mine", folder_ / "out/relief.glsl");
  EXPECT_THROW(write_export(make_export(job("relief")), folder_ / "out"), Error);
  EXPECT_EQ(file_text(folder_ / "mine"), "mine");
}

TEST_F(ExportTest, nothing_is_half_written) {
  const Export exported = make_export(job("relief"));
  std::filesystem::create_directories(folder_ / "out/settings.json");
  EXPECT_THROW(write_export(exported, folder_ / "out"), Error);
  EXPECT_EQ(names_in("out"), std::set<std::string>{"settings.json"});
  Export broken = exported;
  broken.files[1].name = "no/such/folder";
  EXPECT_THROW(write_export(broken, folder_ / "new"), Error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new"));
  write_atomically(folder_ / "file", "");
  EXPECT_THROW(write_export(exported, folder_ / "file"), Error);
}

class ExportCommand : public ExportTest {
 protected:
  void SetUp() override {
    const std::vector<reliefbench::Run> runs = {load_run(null_sweep(folder_))};
    presets_ = presets_json(make_presets(runs, {}));
    write_atomically(folder_ / "presets.json", presets_.dump(1));
  }
  [[nodiscard]] CommandResult ship(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"export", "fbm", "--size", "32x32"});
    return run_reliefbench(arguments, folder_.path());
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& words) const {
    const CommandResult result = ship(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  nlohmann::json presets_;
};

TEST_F(ExportCommand, ships_a_level_with_its_evidence) {
  const CommandResult text = ship({"--presets", "presets.json", "--quality", "50", "--backend", "null", "-o", "out"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  for (const char* words : {"measured in fbm_32x32/oblique", "relief.glsl", "written: out"})
    EXPECT_THAT(text.out, HasSubstr(words));
  const CommandResult json =
      ship({"--presets", "presets.json", "--quality", "50", "--device-name", "*", "-o", "out", "--json"});
  ASSERT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(json.out, file_text(folder_ / "out/settings.json"));
  const nlohmann::json settings = nlohmann::json::parse(json.out);
  EXPECT_EQ(schema_errors(settings, "export"), "");
  nlohmann::json level;  // the best up to 50
  for (const nlohmann::json& one : presets_["devices"][0]["levels"])
    if (one["quality"] <= 50) level = one;
  EXPECT_EQ(settings["params"], level["params"]);
  nlohmann::json evidence = level["evidence"];
  for (nlohmann::json& one : evidence) one.erase("run");
  EXPECT_EQ(settings["evidence"]["scenes"], evidence);
  EXPECT_EQ(settings["evidence"]["error"], level["error"]);
  EXPECT_EQ(settings["evidence"]["error_metric"], "e_xy.p95");
}

TEST_F(ExportCommand, ships_a_case_by_its_id) {
  const CommandResult result = ship({"--case", "relief@fbm_32x32/top?linear_steps=9&backend=vulkan", "--wrap", "clamp",
                                     "--relief-depth", "0.25", "-o", "out", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json settings = nlohmann::json::parse(result.out);
  EXPECT_EQ(settings["params"]["linear_steps"], "9");
  EXPECT_EQ(settings["wrap"], "clamp");
  EXPECT_TRUE(settings["evidence"].is_null());
  EXPECT_THAT(file_text(folder_ / "out/relief.glsl"), HasSubstr("view_ray(uv, view, 0.25)"));
}

TEST_F(ExportCommand, what_cannot_ship_is_refused_in_one_line) {
  const auto with_presets = [&](std::vector<std::string> rest, const std::string& words) {
    rest.insert(rest.begin(), {"--presets", "presets.json"});
    rest.insert(rest.end(), {"-o", "out"});
    expect_refused(rest, words);
  };
  with_presets({"--quality", "101"}, "presets.json: there is no level 101; it has 0, ");
  with_presets({"--quality", "50", "--backend", "metal"}, "no device '*' of backend 'metal' (it has null (");
  with_presets({"--quality", "50", "--device-name", "H200*"}, "no device 'H200*'");
  with_presets({}, "--quality");
  with_presets({"--quality", "50", "--case", "relief"}, "--case");
  expect_refused({"-o", "out"}, "--presets with --quality, or --case");
  expect_refused({"--presets", "none.json", "--quality", "50", "-o", "out"}, "none.json");
  expect_refused({"--case", "cane", "-o", "out"}, "unknown technique 'cane'");
  expect_refused({"--case", "cone?format=r8", "-o", "out"}, "format r8 has room for 0 cone ratios");
  expect_refused({"--case", "relief", "--wrap", "mirror", "-o", "out"}, "--wrap");
  expect_refused({"--case", "relief", "-o", "presets.json/out"}, "presets.json/out: cannot be made");
  presets_["devices"].push_back(presets_["devices"][0]);
  presets_["devices"][1]["device"] = "another";
  write_atomically(folder_ / "presets.json", presets_.dump(1));
  with_presets({"--quality", "50"}, "holds 2 devices, choose one by --backend and --device-name: null (another), ");
}

}  // namespace
}  // namespace reliefbench
