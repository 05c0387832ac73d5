// What ships: the textures are those that were measured, the files those that were asked for.
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
#include "kernels/trace/surface.h"
#include "reports/export/glsl_fold.h"
#include "reports/export/shader_pieces.h"
#include "tests/command.h"
#include "tests/export_rig.h"
#include "tests/finished_run.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

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
  EXPECT_EQ(body("  return A == ONE ? f(x, y) : z;\n"), kept("  return f(x, y);\n"));
  EXPECT_EQ(body("  x = g(A == TWO ? y : f(z), 0);  // A == TWO ? y : z\n"),
            kept("  x = g(f(z), 0);  // A == TWO ? y : z\n"));
  EXPECT_EQ(body("  x = a == ONE ? y : z;\n"), kept("  x = a == ONE ? y : z;\n"));
  EXPECT_EQ(body("  if (x) {\n    if (A == ONE) {\n      if (A == TWO) y;\n      z;\n    }\n  }\n"),
            kept("  if (x) {\n    z;\n  }\n"));
}

TEST(GlslFold, what_is_laid_out_in_another_way_ends) {
  const GlslConstants constants = {{"A", 1}, {"ONE", 1}};
  EXPECT_EQ(folded("  if (A == ONE) return x;", constants), "  return x;\n");  // found by fuzzing: it had no end
  EXPECT_THAT([&] { (void)folded("  if (A == ONE) {\n    x;\n", constants); },
              ThrowsMessage<Error>(HasSubstr("shader text: \"  if (A == ONE) {\" opens a block that nothing ends")));
  EXPECT_THAT([] { (void)pieces_of("#define (\n"); },
              ThrowsMessage<Error>(HasSubstr("\"#define (\" declares nothing")));
  EXPECT_THAT([] { (void)pieces_of("= 3;\n"); }, ThrowsMessage<Error>(HasSubstr("\"= 3;\" declares nothing")));
}

const ExportedFile* file_of(const Export& exported, const std::string& name) {
  const auto found = std::ranges::find(exported.files, name, &ExportedFile::name);
  return found == exported.files.end() ? nullptr : &*found;
}

class ExportTest : public ::testing::Test {
 protected:
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
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(ExportTest, textures_are_those_that_the_technique_is_measured_with) {
  for (const std::string& id : shipped_settings()) {
    SCOPED_TRACE(id);
    ExportJob shipped = job(id);
    if (shipped.settings.technique().is_of_solids()) shipped.heightmap.source = "ball";
    const Export exported = make_export(shipped);
    EXPECT_EQ(schema_errors(nlohmann::json::parse(exported.files.back().bytes), "export"), "");
    for (std::size_t i = 0; i + 1 < exported.files.size(); ++i)
      EXPECT_EQ(exported.settings["files"][i]["sha256"], sha256(exported.files[i].bytes));
    if (!shipped.settings.technique().reads_map()) {
      EXPECT_EQ(exported.files.size(), 4U);
      continue;
    }
    const StoredMap map = store_map(shipped.settings, load_heightmap(shipped.heightmap), Wrap::repeat);
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

TEST_F(ExportTest, a_conservative_depth_is_declared_and_kept) {
  const auto example = [&](const std::string& id) { return file_of(make_export(job(id)), "example.frag")->bytes; };
  const std::string conservative = example("relief?depth=conservative");
  EXPECT_THAT(conservative, AllOf(HasSubstr("layout(depth_greater) out float gl_FragDepth;"),
                                  HasSubstr("gl_FragDepth = max(surface.depth, gl_FragCoord.z);")));
  EXPECT_THAT(example("relief?depth=write"),
              AllOf(HasSubstr("gl_FragDepth = surface.depth;"), Not(HasSubstr("depth_greater"))));
  ExportJob raised = job("relief?depth=conservative");
  raised.base = 0.5;
  EXPECT_THAT([&] { (void)make_export(raised); }, ThrowsMessage<Error>(HasSubstr("ships with base 1")));
}

// What was measured reads a chain of them.
TEST_F(ExportTest, a_normal_map_has_the_levels_that_are_read) {
  const auto levels = [&](const std::string& id) {
    ExportJob with_normals = job(id);
    with_normals.choice.normal_map = true;
    const Export exported = make_export(with_normals);
    return decode_ktx2(std::as_bytes(std::span(file_of(exported, "relief.normal.ktx2")->bytes)), "normal").image.levels;
  };
  EXPECT_EQ(levels("relief"), 1);
  EXPECT_EQ(levels("relief?normals=footprint"), 6);
}

TEST_F(ExportTest, a_later_export_replaces_its_own_files_alone) {
  write_export(make_export(job("max_mip")), folder_ / "a/b");
  EXPECT_EQ(names_in("a/b"), (std::set<std::string>{"relief.ktx2", "relief.extra.ktx2", "relief.glsl", "example.frag",
                                                    "README.md", "settings.json"}));
  write_atomically(folder_ / "a/b/mine.txt", "mine");
  write_export(make_export(job("relief")), folder_ / "a/b");
  EXPECT_EQ(names_in("a/b"), (std::set<std::string>{"mine.txt", "relief.ktx2", "relief.glsl", "example.frag",
                                                    "README.md", "settings.json"}));
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
  broken.files[1].name = broken.files[0].name + "/x";  // a file is no folder
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
  EXPECT_THAT(file_text(folder_ / "out/relief.glsl"), HasSubstr("measured with 0.25"));
}

TEST_F(ExportCommand, says_what_fills_the_holes_of_a_solid) {
  const auto ship_ball = [&](const char* technique) {
    return run_reliefbench({"export", "ball", "--size", "16x16", "--case", technique, "-o", "out"}, folder_.path());
  };
  const CommandResult filled = ship_ball("relief");
  EXPECT_EQ(filled.exit_code, 0) << filled.err;
  EXPECT_THAT(filled.err, HasSubstr("warning: relief sees the upper surface of ball_16x16, a solid, alone"));
  EXPECT_EQ(ship_ball("double_relief").err, "");
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
  expect_refused({"-o", "out"}, "--presets with --quality, --case, or --tune");
  expect_refused({"--presets", "none.json", "--quality", "50", "-o", "out"}, "none.json");
  expect_refused({"--case", "cane", "-o", "out"}, "technique 'cane' is unknown");
  expect_refused({"--case", "cone?format=r8", "-o", "out"}, "format r8 has room for 0 cone ratios");
  expect_refused({"--case", "relief", "--wrap", "mirror", "-o", "out"}, "--wrap");
  expect_refused({"--case", "relief?silhouette=quadric", "--for", "unity", "-o", "out"}, "no engine's recipe");
  expect_refused({"--case", "relief?dispatch=compute", "--for", "godot", "-o", "out"},
                 "no engine's recipe is a compute shader, which dispatch=compute measures; export it without --for");
  expect_refused({"--case", "cone?dispatch=compute&lod=footprint", "-o", "out"},
                 "takes derivatives, which compute shaders have none of (dispatch=compute)");
  expect_refused({"--case", "relief?dither=temporal", "--for", "godot", "-o", "out"},
                 "no engine's recipe passes the number of the frame that dither=temporal needs");
  expect_refused({"--case", "double_relief", "-o", "out"}, "needs a heightmap of two heights a texel");
  expect_refused({"--case", "relief", "-o", "presets.json/out"}, "presets.json/out: cannot be made");
  presets_["devices"].push_back(presets_["devices"][0]);
  presets_["devices"][1]["device"] = "another";
  write_atomically(folder_ / "presets.json", presets_.dump(1));
  with_presets({"--quality", "50"}, "holds 2 devices, choose one by --backend and --device-name: null (another), ");
}

}  // namespace
}  // namespace reliefbench
