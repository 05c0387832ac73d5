// What engines are told of an export, and which files they get: all of it true of their importers.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>

#include "kernels/base/error.h"
#include "kernels/maps/map_texture.h"
#include "reports/export/export.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

class ExportRecipes : public ::testing::Test {
 protected:
  static ExportJob job(const std::string& id, const std::string& engine) {
    return {.heightmap = {.source = "fbm", .width = 32, .height = 32},
            .settings = parse_setting(id),
            .choice = {.engines = {engine}}};
  }
  /// Files by their names in the engine's folder.
  static std::map<std::string, std::string> files(const ExportJob& job) {
    std::map<std::string, std::string> files;
    const std::string folder = job.choice.engines.front() == kPlainEngine ? "" : job.choice.engines.front() + "/";
    for (const ExportedFile& file : make_export(job).files)
      if (file.name.starts_with(folder)) files.emplace(file.name.substr(folder.size()), file.bytes);
    return files;
  }
  static std::string sheet(const ExportJob& job) { return files(job).at("README.md"); }
  static std::string sheet(const std::string& id, const std::string& engine) { return sheet(job(id, engine)); }
  static void expect_refused(const std::string& id, const std::string& engine, const std::string& words,
                             const std::string& container = "") {
    ExportJob refused = job(id, engine);
    refused.choice.container = container;
    EXPECT_THAT([&] { (void)make_export(refused); }, ThrowsMessage<Error>(HasSubstr(words))) << id << " " << engine;
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

/// What a DDS holds.
struct Dds {
  std::uint32_t format = 0;
  std::uint32_t levels = 0;
  std::vector<float> texels{};  ///< of floats of 32 bits
};
Dds read_dds(const std::string& bytes) {
  Dds dds;
  std::memcpy(&dds.levels, &bytes.at(28), 4);
  std::memcpy(&dds.format, &bytes.at(128), 4);
  dds.texels.resize((bytes.size() - 148) / 4);
  std::memcpy(dds.texels.data(), &bytes.at(148), dds.texels.size() * 4);
  return dds;
}

TEST_F(ExportRecipes, what_no_recipe_passes_is_said_in_one_line) {
  const std::string end = "; export it without --for";
  for (const auto& [id, words] :
       {std::pair("relief?fade=distance", "passes the eye's distance in tiles that fade=distance needs"),
        std::pair("relief?depth=rtm", "passes what depth=rtm needs"),
        std::pair("relief?silhouette=quadric_exact", "passes the curvature that silhouette=quadric_exact needs"),
        std::pair("relief?dither=pixel", "passes the pixel that dither=pixel needs"),
        std::pair("relief?dispatch=compute", "is a compute shader, which dispatch=compute measures")}) {
    expect_refused(id, "godot", fmt::format("no engine's recipe {}{}", words, end));
    EXPECT_NO_THROW((void)make_export(job(id, "plain"))) << id;
  }
  ExportJob clipped = job("relief?silhouette=clip", "bevy");
  clipped.wrap = Wrap::clamp;
  EXPECT_THAT([&] { (void)make_export(clipped); },
              ThrowsMessage<Error>(HasSubstr("no engine's recipe leaves out what silhouette=clip lets pass")));
  ExportJob solid = job("double_relief", "bevy");
  solid.heightmap.source = "ball";
  EXPECT_THAT([&] { (void)make_export(solid); },
              ThrowsMessage<Error>(HasSubstr("no engine's recipe leaves out what double_relief lets pass")));
}

bool is_texture(const std::string& name) {
  return std::ranges::any_of(containers(), [&](const Container& container) { return name.ends_with(container.id); });
}

TEST_F(ExportRecipes, shadows_have_the_light_that_was_measured) {
  const Light light{.angular_radius_deg = 3};
  const std::string radius =
      fmt::format("{}", static_cast<float>(std::tan(light.angular_radius_deg * std::numbers::pi / 180)));
  for (const Engine& engine : engines())
    for (const bool is_measured : {true, false}) {
      SCOPED_TRACE(engine.id);
      ExportJob soft = job("interval?search=cone&shadow=soft_cone", std::string(engine.id));
      soft.choice.languages = {"glsl"};
      const std::string expected = is_measured ? radius : "0.0";
      if (is_measured)
        soft.scene = SceneSpec{.id = "x", .heightmap = soft.heightmap, .scene = {.view = {}, .light = light}};
      std::string code;
      std::string text;
      for (const auto& [name, bytes] : files(soft))
        if (!is_texture(name)) (name == "README.md" ? text : code) += bytes;
      EXPECT_THAT(text, HasSubstr(fmt::format("an angular radius whose tangent is {}", expected)));
      EXPECT_THAT(code, HasSubstr(fmt::format("0: a point; measured with {}", expected)));
      EXPECT_THAT(code, ::testing::ContainsRegex(fmt::format("relief_trace[(][^;]*, {}[)];", expected))) << code;
    }
  EXPECT_THAT(sheet("relief", "unreal"), Not(HasSubstr("radius")));
}

TEST_F(ExportRecipes, sheets_say_where_the_mesh_lies) {
  for (const Engine& engine : engines()) {
    SCOPED_TRACE(engine.id);
    ExportJob based = job("relief?format=r8", std::string(engine.id));
    based.relief_depth = 0.5;
    const std::string down = sheet(based);
    EXPECT_THAT(down, HasSubstr("is the relief's top, and heights go down from it by 0.5 sides of a tile"));
    EXPECT_EQ(down.find("Nothing stands out") != std::string::npos, engine.id == "unreal");
    based.base = 0.25;
    const std::string both = sheet(based);
    for (const char* words : {"lies at the height 0.25 of the relief", "go down from it by 0.125",
                              "stand out of it by 0.375 sides of a tile"})
      EXPECT_THAT(both, HasSubstr(words));
    based.base = 0;
    const std::string up = sheet(based);
    EXPECT_THAT(up, HasSubstr("is the relief's bottom, and heights stand out of it by 0.5 sides of a tile"));
    for (const std::string& sheet : {both, up})
      for (const char* absent : {"relief's top", "Nothing stands out"}) EXPECT_THAT(sheet, Not(HasSubstr(absent)));
  }
}

TEST_F(ExportRecipes, unreal_has_no_two_wide_channels_and_no_blocks) {
  for (const auto& [format, dxgi] :
       {std::pair("rg16", 11U), std::pair("rg16f", 10U), std::pair("rg32f", 2U), std::pair("rg8", 49U)}) {
    const auto made = files(job(fmt::format("cone?lod=footprint&format={}", format), "unreal"));
    const Dds dds = read_dds(made.at("relief.dds"));
    EXPECT_EQ(dds.format, dxgi) << format;
    EXPECT_EQ(dds.levels, 6U);
  }
  EXPECT_EQ(read_dds(files(job("qdm?format=r16", "unreal")).at("relief.extra.dds")).format, 56U);
  const Dds four = read_dds(files(job("cone?lod=footprint&format=rg32f", "unreal")).at("relief.dds"));
  const Dds two = read_dds(files(job("cone?lod=footprint&format=rg32f", "unity")).at("relief.dds"));
  ASSERT_EQ(two.format, 16U);
  ASSERT_EQ(four.texels.size(), 2 * two.texels.size());
  for (std::size_t i = 0; i < two.texels.size(); ++i) {
    ASSERT_EQ(four.texels[i / 2 * 4 + i % 2], two.texels[i]);
    ASSERT_EQ(four.texels[i / 2 * 4 + 2 + i % 2], 0);
  }
  const Export exported = make_export(job("cone?lod=footprint&format=rg16", "unreal"));
  EXPECT_EQ(exported.settings["textures"][0]["format"], "R16G16B16A16_UNORM");
  EXPECT_THAT(files(job("cone?lod=footprint&format=rg16", "unreal")).at("Relief.usf"),
              HasSubstr("6 levels, R16G16B16A16_UNORM: r = height"));
  for (const char* format : {"bc5", "bc7"})
    expect_refused(fmt::format("cone?format={}", format), "unreal",
                   "relief: Unreal Engine 5 reads no blocks (BC4, BC5, BC7) from DDS");
  expect_refused("relief?format=bc4", "unreal", "reads no blocks");
}

TEST_F(ExportRecipes, o3de_has_linear_presets_that_keep_all_channels) {
  for (const auto& [id, preset] :
       {std::pair("cone?format=rg8", "*Preset* **LUT_RGBA8**"), std::pair("relief?format=r8", "*Preset* **LUT_RGBA8**"),
        std::pair("relief?format=r16", "*Preset* **LUT_R32F**"),
        std::pair("relief?format=r16f", "*Preset* **LUT_R32F**"),
        std::pair("cone?format=rg32f", "*Preset* **LUT_RG32F**"),
        std::pair("quad_cone?format=r32f+rgba32f", "*Preset* **LUT_R32F** (of `relief.extra.exr`: **LUT_RGBA32F**)")})
    EXPECT_THAT(sheet(id, "o3de"), AllOf(HasSubstr(preset), Not(HasSubstr("ReferenceImage")))) << id;
  ExportJob with_normals = job("cone?format=rg32f", "o3de");
  with_normals.choice.normal_map = true;
  EXPECT_THAT(sheet(with_normals), HasSubstr("**LUT_RG32F** (of `relief.normal.tga`: **LUT_RGBA8**)"));
  expect_refused("cone?lod=footprint", "o3de", "relief: O3DE keeps the first level of a DDS alone");
  expect_refused("qdm", "o3de", "relief.extra: O3DE keeps the first level");
  expect_refused("cone?format=bc5", "o3de", "relief: O3DE takes no DDS but of 8 bits a channel");
  expect_refused("relief?format=r16", "o3de", "takes no DDS but of 8 bits a channel", "dds");
}

// A setting that reads levels of the normal map was measured with them: the file brings them, or the engine makes them.
TEST_F(ExportRecipes, a_normal_map_has_the_levels_that_are_read) {
  for (const Engine& engine : engines()) {
    if (engine.id == kPlainEngine) continue;
    for (const bool reads_levels : {false, true}) {
      ExportJob one = job(reads_levels ? "relief?normals=footprint" : "relief", std::string(engine.id));
      one.choice.normal_map = true;
      const Export exported = make_export(one);
      const bool makes_levels = engine.id == "o3de";
      const nlohmann::json& normals = exported.settings["textures"].back();
      ASSERT_EQ(normals["sampler"], "normal_map");
      EXPECT_EQ(normals["levels"], reads_levels && !makes_levels ? 6 : 1) << engine.id;
      const auto sheet = std::ranges::find_if(
          exported.files, [](const ExportedFile& file) { return file.name.ends_with("README.md"); });
      EXPECT_EQ(sheet->bytes.find("Of `relief.normal.tga` it is on") != std::string::npos, reads_levels && makes_levels)
          << engine.id;
    }
  }
}

TEST_F(ExportRecipes, godot_takes_dds_as_it_is) {
  const auto levels = files(job("qdm?format=r16", "godot"));
  EXPECT_EQ(read_dds(levels.at("relief.extra.dds")).format, 41U);  // R32_FLOAT: there is no R16_UNORM before Godot 4.5
  EXPECT_THAT(levels.at("README.md"),
              AllOf(HasSubstr("Select `relief.exr` in the"),
                    HasSubstr("Of `relief.extra.dds` there is nothing to set: files of DDS have no import options")));
  EXPECT_EQ(read_dds(files(job("cone?lod=footprint&format=rg16f", "godot")).at("relief.dds")).format, 34U);
  const auto all = files(job("cone?lod=footprint&format=rg8", "godot"));
  EXPECT_EQ(read_dds(all.at("relief.dds")).format, 28U);  // two channels of 8 bits would be grey and alpha
  EXPECT_THAT(all.at("README.md"), AllOf(HasSubstr("Of `relief.dds` there is nothing to set"), Not(HasSubstr("Select")),
                                         Not(HasSubstr("Reimport"))));
  EXPECT_THAT(sheet("relief?format=r16", "godot"), AllOf(HasSubstr("Reimport"), Not(HasSubstr("DDS"))));
  expect_refused("relief?format=r16", "godot", "relief cannot be png without loss: it has 1 level of R32_SFLOAT",
                 "png");
}

TEST_F(ExportRecipes, unity_is_told_what_each_importer_has) {
  const std::string dds = sheet("cone?lod=footprint&format=rg8", "unity");
  EXPECT_THAT(dds, HasSubstr("\n2. Select `relief.dds`. In the *Inspector*: *sRGB (Color Texture)* off"));
  for (const char* absent : {"Texture Type", "*Compression*", "*Format*", "Generate Mipmaps"})
    EXPECT_THAT(dds, Not(HasSubstr(absent)));
  const std::string both = sheet("qdm?format=r8", "unity");
  EXPECT_THAT(both, AllOf(HasSubstr("of `relief.png` also: *Texture Type* **Default**"), HasSubstr("*Format* **R 8**"),
                          HasSubstr("Select `relief.png` and `relief.extra.dds`")));
  EXPECT_THAT(sheet("quad_cone?format=r8+rgba8", "unity"),
              HasSubstr("**R 8** (of `relief.extra.png`: **RGBA 32 bit**)"));
}

TEST_F(ExportRecipes, without_maps_nothing_is_said_of_samplers) {
  for (const Engine& engine : engines())
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      ExportJob flat = job("flat", std::string(engine.id));
      flat.wrap = wrap;
      for (const auto& [name, bytes] : files(flat))
        for (const char* word : {"Wrap Mode", "Tiling Method", "AddressU", "address_mode", "wrapS", "Sampler:"})
          EXPECT_THAT(bytes, Not(HasSubstr(word))) << engine.id << " " << name;
    }
}

TEST_F(ExportRecipes, bevy_is_told_the_feature_that_a_format_needs) {
  for (const auto& [id, feature] :
       {std::pair("cone?format=bc5", "TEXTURE_COMPRESSION_BC"), std::pair("cone?format=bc7", "TEXTURE_COMPRESSION_BC"),
        std::pair("cone?format=eac_rg11", "TEXTURE_COMPRESSION_ETC2"),
        std::pair("relief?format=r16", "TEXTURE_FORMAT_16BIT_NORM"),
        std::pair("cone?format=rg32f", "FLOAT32_FILTERABLE")})
    EXPECT_THAT(sheet(id, "bevy"), HasSubstr(fmt::format("They need the feature `{}` of wgpu", feature))) << id;
  for (const char* id : {"cone?format=rg8", "cone?format=rg16f"})
    EXPECT_THAT(sheet(id, "bevy"), Not(HasSubstr("of wgpu"))) << id;
}

TEST_F(ExportRecipes, fragments_beside_the_relief_go_after_the_derivatives) {
  for (const auto& [engine, file, word] :
       {std::tuple("godot", "relief.gdshader", "discard;"), std::tuple("unity", "ReliefURP.shader", "clip("),
        std::tuple("bevy", "assets/relief/relief_material.wgsl", "discard;"),
        std::tuple("plain", "example.frag", " discard;")}) {
    ExportJob clamped = job("cone?lod=footprint&format=rg8", engine);
    clamped.wrap = Wrap::clamp;
    const std::string text = files(clamped).at(file);
    const std::size_t traced = text.rfind("= relief_trace(");
    ASSERT_NE(traced, std::string::npos) << engine;
    EXPECT_GT(text.rfind(word), traced) << engine;
    EXPECT_EQ(text.find(word), text.rfind(word)) << engine;
  }
}

}  // namespace
}  // namespace reliefbench
