// Textures in the files that engines take: what comes out is what went in, and what a file cannot hold is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "kernels/image/decode.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/map_texture.h"
#include "reports/export/container.h"
#include "reports/export/export.h"
#include "tests/command.h"
#include "tests/image_files.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

/// Texels whose bytes all differ from their neighbours'; floats are small and finite.
TextureImage pattern(TexelType type, int channels, int levels) {
  TextureImage image{.width = 5, .height = 3, .layout = {.type = type, .channels = channels}, .levels = levels};
  for (int level = 0; level < levels; ++level) {
    const int values = level_side(image.width, level) * level_side(image.height, level) * channels;
    for (int i = 0; i < values; ++i) {
      const float value = static_cast<float>((i * 37 + level * 11) % 101) / 101.0F;
      const std::uint32_t code = nearest_code(value, type);
      const auto bytes = std::as_bytes(std::span(&code, 1));
      image.texels.insert(image.texels.end(), bytes.begin(), bytes.begin() + image.layout.bytes() / channels);
    }
  }
  return image;
}

/// The first level of a picture's file, decoded, with its channels.
Image decoded(const Container& container, const std::string& bytes) {
  const FileBytes file(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  if (container.id == "png") return decode_png(file, "png");
  return container.id == "tga" ? decode_tga(file, "tga") : decode_exr(file, "exr");
}

std::uint32_t dds_word(const std::string& bytes, std::size_t index) {
  std::uint32_t value = 0;
  std::memcpy(&value, &bytes.at(index * 4), 4);
  return value;
}

TEST(ExportContainers, give_back_what_they_were_given) {
  int held = 0;
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32})
    for (const int channels : {1, 2, 4})
      for (const int levels : {1, 3}) {
        const TextureImage image = pattern(type, channels, levels);
        for (const Container& container : containers()) {
          SCOPED_TRACE(fmt::format("{} {} x {}, {} levels", container.id, texel_type_id(type), channels, levels));
          if (!container.holds(image)) continue;
          ++held;
          const std::string bytes = container.encode(image, {{"reliefbench.test", "yes"}});
          if (container.id == "ktx2") {
            EXPECT_EQ(decode_ktx2(std::as_bytes(std::span(bytes)), "ktx2").image.texels, image.texels);
            continue;
          }
          if (container.id == "dds") {
            EXPECT_TRUE(bytes.starts_with("DDS "));
            EXPECT_EQ(dds_word(bytes, 3), 3U);
            EXPECT_EQ(dds_word(bytes, 4), 5U);
            EXPECT_EQ(dds_word(bytes, 7), static_cast<std::uint32_t>(levels));
            ASSERT_EQ(bytes.size(), 148 + image.texels.size());
            EXPECT_EQ(std::memcmp(&bytes[148], image.texels.data(), image.texels.size()), 0);
            continue;
          }
          const Image read = decoded(container, bytes);
          const std::size_t stored = read.channels.size();
          ASSERT_EQ(stored, channels == 2 ? 3U : static_cast<std::size_t>(channels));
          for (int c = 0; c < channels; ++c) {
            const std::vector<float> expected = read_channel(image, c);
            const auto name = channels == 1 ? std::string("Y") : std::string(1, "RGBA"[c]);
            const auto at = static_cast<std::size_t>(std::ranges::find(read.channels, name) - read.channels.begin());
            ASSERT_LT(at, stored) << name;
            for (std::size_t i = 0; i < expected.size(); ++i)
              ASSERT_EQ(read.pixels[i * stored + at], expected[i]) << name << " " << i;
          }
        }
      }
  EXPECT_EQ(held, 24 + 24 + 6 + 3 + 12);
}

TEST(ExportContainers, dds_formats_are_direct3ds) {
  const auto format = [](TexelType type, int channels) {
    return dds_word(find_container("dds").encode(pattern(type, channels, 1), {}), 32);
  };
  EXPECT_EQ(format(TexelType::unorm8, 1), 61U);   // R8_UNORM
  EXPECT_EQ(format(TexelType::unorm16, 2), 35U);  // R16G16_UNORM
  EXPECT_EQ(format(TexelType::float16, 4), 10U);  // R16G16B16A16_FLOAT
  EXPECT_EQ(format(TexelType::float32, 2), 16U);  // R32G32_FLOAT
  EXPECT_EQ(format(TexelType::rgtc, 1), 80U);     // BC4_UNORM
  EXPECT_EQ(format(TexelType::rgtc, 2), 83U);     // BC5_UNORM
  EXPECT_EQ(format(TexelType::bc7, 2), 98U);      // BC7_UNORM
  EXPECT_FALSE(find_container("dds").holds(pattern(TexelType::eac, 2, 1))) << "Direct3D has no EAC";
}

TEST(ExportContainers, rows_are_turned_over_level_by_level) {
  const TextureImage image = pattern(TexelType::unorm8, 1, 2);  // 5 x 3, then 2 x 1
  const TextureImage turned = turned_over(image);
  EXPECT_EQ(read_channel(turned, 0)[0], read_channel(image, 0)[10]);
  EXPECT_EQ(read_channel(turned, 0, 1), read_channel(image, 0, 1));
  EXPECT_EQ(turned_over(turned).texels, image.texels);
}

class ExportForEngines : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult ship(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"export", "fbm", "--size", "32x32"});
    return run_reliefbench(arguments, folder_.path());
  }
  [[nodiscard]] bool has(const std::string& name) const { return std::filesystem::exists(folder_ / "out" / name); }
  TempFolder folder_;
};

TEST_F(ExportForEngines, all_engines_have_their_folders) {
  const CommandResult result = ship({"--case", "quad_cone?format=r16+rgba16", "--for", "all", "--language", "all",
                                     "--normal-map", "-o", "out", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json settings = nlohmann::json::parse(result.out);
  EXPECT_EQ(schema_errors(settings, "export"), "");
  const std::set<std::string> possible = all_export_names();
  for (const nlohmann::json& file : settings["files"]) {
    const std::string name = file["file"];
    EXPECT_TRUE(has(name)) << name;
    EXPECT_TRUE(possible.contains(name)) << name;
  }
  for (const char* name : {"relief.metal", "example.spv", "unreal/Relief.usf", "unreal/relief.png",
                           "unity/relief.extra.png", "godot/relief.exr", "godot/relief.normal.tga", "three/relief.ktx2",
                           "o3de/Relief.azsli", "bevy/assets/relief/relief.wgsl"})
    EXPECT_TRUE(has(name)) << name;
  // The next export takes all of that away again but what is not its own.
  write_bytes(folder_ / "out/unity/mine.txt", "mine");
  ASSERT_EQ(ship({"--case", "relief", "--for", "godot", "-o", "out"}).exit_code, 0);
  EXPECT_TRUE(has("unity/mine.txt"));
  EXPECT_TRUE(has("godot/relief.gdshader"));
  for (const char* name : {"unreal", "bevy", "relief.metal", "unity/relief.png"}) EXPECT_FALSE(has(name)) << name;
}

TEST_F(ExportForEngines, all_leaves_out_who_cannot_have_it) {
  const CommandResult result = ship({"--case", "cone?lod=footprint", "--for", "all", "-o", "out"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("left out: o3de: relief: O3DE keeps the first level of a DDS alone\n"));
  EXPECT_FALSE(has("o3de"));
  for (const char* name : {"relief.glsl", "unreal/relief.dds", "godot/relief.dds", "three/relief.ktx2"})
    EXPECT_TRUE(has(name)) << name;
  // Of a recipe that no engine has, the plain files are left.
  const CommandResult dithered = ship({"--case", "relief?dither=temporal", "--for", "all", "-o", "dithered"});
  EXPECT_EQ(dithered.exit_code, 0) << dithered.err;
  EXPECT_THAT(dithered.err, HasSubstr("left out: bevy: no engine's recipe passes"));
}

TEST_F(ExportForEngines, unity_gets_its_pictures_from_the_bottom) {
  ASSERT_EQ(ship({"--case", "relief?format=r8", "--for", "unity,unreal", "-o", "out"}).exit_code, 0);
  const auto read = [&](const std::string& name, const char* kind) {
    return decoded(find_container(kind), file_text(folder_ / "out" / name)).pixels;
  };
  const std::vector<float> down = read("unreal/relief.tga", "tga");
  const std::vector<float> up = read("unity/relief.png", "png");
  ASSERT_EQ(up.size(), 1024U);
  for (std::size_t i = 0; i < up.size(); ++i) ASSERT_EQ(up[i], down[(31 - i / 32) * 32 + i % 32]);
}

TEST_F(ExportForEngines, what_cannot_be_is_said_in_one_line) {
  const auto expect_refused = [&](std::vector<std::string> arguments, const std::string& words) {
    arguments.insert(arguments.end(), {"-o", "out"});
    const CommandResult result = ship(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(has(""));
  };
  expect_refused({"--case", "relief", "--for", "source2"}, "engine 'source2' is unknown (known: plain, unreal, ");
  expect_refused({"--case", "relief", "--language", "cg"}, "shading language 'cg' is unknown");
  expect_refused({"--case", "relief", "--textures", "jpg"}, "kind of texture file 'jpg' is unknown");
  expect_refused({"--case", "relief?format=r32f", "--textures", "png"},
                 "relief cannot be png without loss: it has 1 level of R32_SFLOAT, a png file holds 8 and 16 bits");
  expect_refused({"--case", "qdm", "--textures", "exr"}, "relief.extra cannot be exr without loss: it has 6 levels");
  expect_refused({"--case", "cone?format=eac_rg11", "--textures", "dds"},
                 "relief cannot be dds without loss: it has 1 level of EAC_RG11_UNORM, a dds file holds every format "
                 "but EAC and ASTC");
  expect_refused({"--case", "relief?format=eac_r11", "--for", "unreal"},
                 "relief: Unreal Engine 5 has no kind of file for 1 level of EAC_R11_UNORM; --textures ktx2");
  expect_refused({"--case", "cone?format=astc", "--for", "bevy"},
                 "relief: Bevy 0.17 has no view of ASTC_4x4_UNORM, with alpha read as green");
}

TEST_F(ExportForEngines, astc_ships_where_views_swizzle) {
  const CommandResult plain = ship({"--case", "cone?format=astc", "-o", "out"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  const std::string bytes = file_text(folder_ / "out/relief.ktx2");
  EXPECT_EQ(decode_ktx2(std::as_bytes(std::span(bytes)), "x").metadata.at("KTXswizzle"), "ra01");
  EXPECT_THAT(file_text(folder_ / "out/README.md"), HasSubstr("ASTC_4x4_UNORM, with alpha read as green"));
}

TEST_F(ExportForEngines, blocks_of_eac_ship_as_ktx2) {
  ASSERT_EQ(ship({"--case", "cone?format=eac_rg11", "--for", "plain,bevy", "-o", "out"}).exit_code, 0);
  for (const char* name : {"relief.ktx2", "bevy/assets/relief/relief.ktx2"}) {
    const std::string bytes = file_text(folder_ / "out" / name);
    const Ktx2File file = decode_ktx2(std::as_bytes(std::span(bytes)), name);
    EXPECT_EQ(file.image.layout, (TexelLayout{.type = TexelType::eac, .channels = 2}));
  }
}

TEST_F(ExportForEngines, wgsl_wants_node_and_naga) {
  CommandSetting without_naga{.environment = {{"RELIEFBENCH_NAGA", "/nowhere"}}};
  const std::vector<std::string> arguments = {"export", "fbm",   "--size", "32x32", "--case",
                                              "relief", "--for", "three",  "-o",    "out"};
  CommandResult result = run_reliefbench(arguments, folder_.path(), without_naga);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("naga, which is not there: run ./dev setup"));
  CommandSetting without_node{.environment = {{"PATH", "/nowhere"}}};
  result = run_reliefbench(arguments, folder_.path(), without_node);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("no `node` on PATH"));
  EXPECT_FALSE(has(""));
}

TEST_F(ExportForEngines, a_folder_behind_a_link_is_not_written_to) {
  std::filesystem::create_directories(folder_ / "mine");
  std::filesystem::create_directories(folder_ / "out");
  std::filesystem::create_directory_symlink(folder_ / "mine", folder_ / "out/godot");
  const CommandResult result = ship({"--case", "relief", "--for", "godot", "-o", "out"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("out/godot: is not of an export"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "mine"));
}

}  // namespace
}  // namespace reliefbench
