#include "kernels/image/heightmap.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/image_files.h"
#include "tests/scoped_variable.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<float> load(const std::filesystem::path& path, const std::string& channel = "auto") {
  return load_heightmap({.source = path.string(), .channel = channel}).texels;
}

std::string load_error(const HeightmapSpec& spec) {
  return input_error([&] { (void)load_heightmap(spec); });
}

/// 2x2 floats in one channel.
std::filesystem::path exr(const TempFolder& folder, std::vector<float> pixels) {
  write_image(folder / "map.exr", {2, 2, 1, TexelType::float32, std::move(pixels)});
  return folder / "map.exr";
}

TEST(Heightmap, SixteenBitsStaySixteen) {
  const TempFolder folder;
  const std::vector<float> codes = code_ramp(256 * 256, 65536);
  write_image(folder / "map.png", {256, 256, 1, TexelType::unorm16, codes});
  const Heightfield heights = load_heightmap({.source = (folder / "map.png").string()});
  EXPECT_EQ(heights.width, 256);
  EXPECT_EQ(heights.height, 256);
  EXPECT_TRUE(heights.texels == codes);
}

TEST(Heightmap, FirstRowIsTheImagesTop) {
  const TempFolder folder;
  for (const char* name : {"map.png", "map.tga", "map.tif", "map.pgm", "map.exr"}) {
    write_image(folder / name, {3, 2, 1, TexelType::unorm8, {0, 0.2F, 0.4F, 0.6F, 0.8F, 1}});
    const std::vector<float> texels = load(folder / name);
    EXPECT_THAT(texels, ::testing::Pointwise(::testing::FloatNear(1e-3F), {0.0F, 0.2F, 0.4F, 0.6F, 0.8F, 1.0F}))
        << name;
  }
}

TEST(Heightmap, EachChannelCanBeChosen) {
  const TempFolder folder;
  std::vector<float> pixels;
  for (int i = 0; i < 4; ++i) pixels.insert(pixels.end(), {0.2F, 0.4F, 0.6F, 0.8F});
  for (const char* name : {"map.png", "map.tga", "map.tif"}) {
    write_image(folder / name, {2, 2, 4, TexelType::unorm8, pixels});
    // Alpha is not multiplied in.
    EXPECT_THAT(load(folder / name, "r"), Each(0.2F)) << name;
    EXPECT_THAT(load(folder / name, "g"), Each(0.4F)) << name;
    EXPECT_THAT(load(folder / name, "b"), Each(0.6F)) << name;
    EXPECT_THAT(load(folder / name, "a"), Each(0.8F)) << name;
    EXPECT_THAT(load(folder / name, "luminance"),
                Each(::testing::FloatEq(0.2126F * 0.2F + 0.7152F * 0.4F + 0.0722F * 0.6F)))
        << name;
  }
}

TEST(Heightmap, AutoTakesAlphaThenLuminanceThenTheFirst) {
  const TempFolder folder;
  const auto path = folder / "map.png";
  const auto auto_of = [&](int channels, std::vector<float> pixels) {
    write_image(path, {2, 2, channels, TexelType::unorm8, std::move(pixels)});
    return load(path);
  };
  // 0.2, 0.4, 0.6, 0.8 are codes of 8 bits.
  EXPECT_THAT(auto_of(4, {0, 0, 0, 0.2F, 1, 1, 1, 0.4F, 0, 0, 0, 0.6F, 1, 1, 1, 0.8F}),
              ElementsAre(0.2F, 0.4F, 0.6F, 0.8F));
  EXPECT_THAT(auto_of(4, {0.2F, 0.2F, 0.2F, 1, 0.4F, 0.4F, 0.4F, 1, 0.6F, 0.6F, 0.6F, 1, 0.8F, 0.8F, 0.8F, 1}),
              ElementsAre(0.2F, 0.4F, 0.6F, 0.8F));
  EXPECT_THAT(auto_of(3, {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}), ElementsAre(0.2126F, 0.7152F, 0.0722F, 1.0F));
  EXPECT_THAT(auto_of(2, {0.2F, 1, 0.4F, 1, 0.6F, 1, 0.8F, 1}), ElementsAre(0.2F, 0.4F, 0.6F, 0.8F));
}

// As the map of a real asteroid has it: grey with a mask.
TEST(Heightmap, AutoTakesGreyWhateverItsAlphaIs) {
  const TempFolder folder;
  for (const char* name : {"map.png", "map.tif"}) {
    write_image(folder / name, {2, 2, 2, TexelType::unorm8, {0.2F, 0, 0.4F, 1, 0.6F, 1, 0.8F, 0}});
    EXPECT_THAT(load(folder / name), ElementsAre(0.2F, 0.4F, 0.6F, 0.8F)) << name;
    EXPECT_THAT(load(folder / name, "a"), ElementsAre(0, 1, 1, 0)) << name;
  }
}

TEST(Heightmap, SaysWhatWasRead) {
  const TempFolder folder;
  const auto reading = [&](const std::string& name, const TestImage& image, HeightmapSpec spec = {}) {
    write_image(folder / name, image);
    spec.source = (folder / name).string();
    std::string text;
    (void)load_heightmap(spec, &text);
    EXPECT_THAT(text, StartsWith(spec.source + ": 2x2, "));
    return text.substr(spec.source.size() + 7);
  };
  const std::vector<float> mask{0.2F, 0, 0.4F, 1, 0.6F, 1, 0.8F, 0};
  const std::vector<float> normals{1, 0, 0, 0.2F, 0, 1, 0, 0.4F, 0, 0, 1, 0.6F, 1, 1, 1, 0.8F};
  const std::vector<float> greys{0.2F, 0.2F, 0.2F, 0.4F, 0.4F, 0.4F, 0.6F, 0.6F, 0.6F, 0.8F, 0.8F, 0.8F};
  EXPECT_EQ(reading("map.png", {2, 2, 2, TexelType::unorm16, mask}), "16-bit grey (alpha ignored)");
  EXPECT_EQ(reading("map.png", {2, 2, 2, TexelType::unorm8, mask}, {.source = "", .channel = "a"}),
            "8-bit alpha (Y ignored)");
  EXPECT_EQ(reading("map.tga", {2, 2, 4, TexelType::unorm8, normals}), "8-bit alpha (R, G, B ignored)");
  EXPECT_EQ(reading("map.tif", {2, 2, 3, TexelType::unorm8, greys}), "8-bit channel R (G, B ignored)");
  EXPECT_EQ(reading("map.exr", {2, 2, 4, TexelType::float32, normals}, {.source = "", .channel = "luminance"}),
            "float luminance (alpha ignored)");
  EXPECT_EQ(reading("map.exr", {2, 2, 1, TexelType::float32, {0, 1, 2, 4}},
                    {.source = "", .invert = true, .normalise = true}),
            "float grey, normalised, inverted");
  std::string text = "before";
  (void)load_heightmap({.source = "fbm", .width = 4, .height = 4}, &text);
  EXPECT_EQ(text, "");
}

TEST(Heightmap, InvertAndNormalise) {
  const TempFolder folder;
  const std::string path = exr(folder, {-10, 0, 10, 30}).string();
  EXPECT_THAT(load_heightmap({.source = path, .normalise = true}).texels, ElementsAre(0, 0.25F, 0.5F, 1));
  EXPECT_THAT(load_heightmap({.source = path, .invert = true, .normalise = true}).texels,
              ElementsAre(1, 0.75F, 0.5F, 0));
  exr(folder, {0, 0.25F, 0.5F, 0.75F});
  EXPECT_THAT(load_heightmap({.source = path, .invert = true}).texels, ElementsAre(1, 0.75F, 0.5F, 0.25F));
  exr(folder, {7, 7, 7, 7});
  EXPECT_THAT(load_heightmap({.source = path, .normalise = true}).texels, Each(0.0F));
}

TEST(Heightmap, NormaliseBearsTheWholeRangeOfFloats) {
  const TempFolder folder;
  const float largest = std::numeric_limits<float>::max();
  const std::string path = exr(folder, {-largest, 0, largest, 0}).string();
  EXPECT_THAT(load_heightmap({.source = path, .normalise = true}).texels, ElementsAre(0, 0.5F, 1, 0.5F));
}

TEST(Heightmap, KeepsDenormals) {
  const TempFolder folder;
  const float denormal = std::numeric_limits<float>::denorm_min();
  EXPECT_THAT(load(exr(folder, {denormal, 1e-40F, 0, 1})), ElementsAre(denormal, 1e-40F, 0, 1));
}

TEST(Heightmap, RefusesPixelsThatAreNotFiniteOrOutOfRange) {
  const TempFolder folder;
  const auto message = [&](float bad, bool normalise) {
    const auto path = exr(folder, {0, 1, 0.5F, bad});
    return load_error({.source = path.string(), .normalise = normalise});
  };
  for (const bool normalise : {false, true}) {
    EXPECT_THAT(message(std::numeric_limits<float>::quiet_NaN(), normalise),
                EndsWith("map.exr: the pixel at (1, 1) is nan; heights must be finite"));
    EXPECT_THAT(message(kInfinity, normalise), HasSubstr("is inf; heights must be finite"));
    EXPECT_THAT(message(-kInfinity, normalise), HasSubstr("is -inf; heights must be finite"));
  }
  EXPECT_THAT(message(1.5F, false), HasSubstr("the pixel at (1, 1) is 1.5; heights must lie in [0, 1] (set normalise"));
  EXPECT_THAT(message(-0.5F, false), HasSubstr("is -0.5; heights must lie in [0, 1]"));
}

TEST(Heightmap, NamesWhatIsWrongWithTheRequest) {
  const TempFolder folder;
  const auto path = folder / "map.png";
  write_image(path, {2, 2, 1, TexelType::unorm8, {0, 0, 0, 1}});
  EXPECT_EQ(load_error({.source = path.string(), .channel = "depth"}),
            "heightmap '" + path.string() + "': unknown channel 'depth'; the choices are auto, r, g, b, a, luminance");
  EXPECT_EQ(load_error({.source = path.string(), .channel = "g"}),
            path.string() + ": has no channel 'g'; its channels are Y");
  EXPECT_EQ(load_error({.source = path.string(), .channel = "a"}),
            path.string() + ": has no channel 'a'; its channels are Y");
  EXPECT_THAT(load_error({.source = "rock"}),
              StartsWith("heightmap 'rock': no such file; the known names are rocks, four, jacksboro, "
                         "bathymetry, arena, island, fbm, "));
  EXPECT_THAT(load_error({.source = folder.path().string()}), EndsWith(": is not a file"));
  EXPECT_THAT(load_error({.source = "fbm", .width = 1, .height = 8}),
              StartsWith("heightmap 'fbm': a size of 1x8 is not possible; each side must be 2 to "));
  EXPECT_THAT(load_error({.source = "fbm", .width = 8, .height = -1}), HasSubstr("8x-1 is not possible"));
}

TEST(Heightmap, RefusesFilesThatAreNoWholeImage) {
  const TempFolder folder;
  const auto path = folder / "map.png";
  write_image(path, {1, 4, 1, TexelType::unorm8, {0, 0, 0, 1}});
  EXPECT_EQ(load_error({.source = path.string()}), path.string() + ": is 1x4 texels; at least 2x2 is needed");
  write_image(path, {32, 32, 1, TexelType::unorm16, code_ramp(32 * 32, 65536)});
  write_bytes(path, read_bytes(path).substr(0, read_bytes(path).size() / 2));
  EXPECT_EQ(load_error({.source = path.string()}), path.string() + ": the PNG is truncated");
}

TEST(Heightmap, ProceduralNamesTakeSizeSeedAndInvert) {
  const Heightfield heights = load_heightmap({.source = "fbm", .width = 32, .height = 48, .seed = 9});
  EXPECT_EQ(heights.width, 32);
  EXPECT_EQ(heights.height, 48);
  EXPECT_NE(heights.texels, load_heightmap({.source = "fbm", .width = 32, .height = 48, .seed = 8}).texels);
  const Heightfield inverted = load_heightmap({.source = "fbm", .invert = true, .width = 32, .height = 48, .seed = 9});
  for (std::size_t i = 0; i < heights.texels.size(); ++i) ASSERT_EQ(inverted.texels[i], 1.0F - heights.texels[i]);
}

TEST(KnownHeightmaps, AreTakenFromTheChosenFolder) {
  const TempFolder folder;
  const ScopedVariable folders("RELIEFBENCH_HEIGHTMAPS", folder.path());
  EXPECT_THAT(heightmap_folders(), ElementsAre(folder.path()));
  // Height in alpha, as in the real file; the colours hold normals.
  write_image(folder / "rocks_NM_height.tga",
              {2, 2, 4, TexelType::unorm8, {1, 0, 0, 0.2F, 0, 1, 0, 0.4F, 0, 0, 1, 0.6F, 1, 1, 1, 0.8F}});
  EXPECT_THAT(load("rocks"), ElementsAre(0.2F, 0.4F, 0.6F, 0.8F));
  EXPECT_THAT(load("rocks", "r"), ElementsAre(1, 0, 0, 1));
  // jacksboro is stretched from metres.
  write_bytes(folder / "jacksboro.pgm",
              std::string("P5\n2 2\n65535\n") + std::string("\x01\x00\x01\x00\x03\x00\x02\x00", 8));
  EXPECT_THAT(load("jacksboro"), ElementsAre(0, 0, 1, 0.5F));
}

TEST(KnownHeightmaps, AreElseBesideTheWorkingFolderOrTheExecutable) {
  const ScopedVariable none("RELIEFBENCH_HEIGHTMAPS", std::nullopt);
  const std::vector<std::filesystem::path> folders = heightmap_folders();
  ASSERT_EQ(folders.size(), 2U);
  EXPECT_EQ(folders[0], "build/heightmaps");
  EXPECT_EQ(folders[1], std::filesystem::canonical("/proc/self/exe").parent_path().parent_path() / "heightmaps");
}

TEST(KnownHeightmaps, TellHowToGetThem) {
  const TempFolder folder;
  const ScopedVariable folders("RELIEFBENCH_HEIGHTMAPS", folder.path());
  EXPECT_EQ(load_error({.source = "four"}),
            "heightmap 'four': four_NM_height.tga is in none of " + folder.path().string() + "; run `./dev setup`");
}

TEST(KnownHeightmapFiles, AreWhatTheirRowsSay) {
  const auto folders = heightmap_folders();
  for (const KnownHeightmapRow& row : known_heightmaps()) {
    const bool found = std::any_of(folders.begin(), folders.end(),
                                   [&](const auto& folder) { return std::filesystem::exists(folder / row.file); });
    const bool is_optional = row.id == "arena" || row.id == "island";
    if (!found && is_optional) continue;
    if (!found) GTEST_SKIP() << row.file << " is not there; run `./dev setup`";
    const Heightfield heights = load_heightmap({.source = std::string(row.id)});
    const int other = is_optional ? 161 : 256;
    EXPECT_EQ(heights.width, row.id == "jacksboro" ? 403 : row.id == "bathymetry" ? 120 : other);
    EXPECT_EQ(heights.height, row.id == "jacksboro" ? 344 : row.id == "bathymetry" ? 91 : other);
    const auto [low, high] = std::minmax_element(heights.texels.begin(), heights.texels.end());
    EXPECT_LT(*low, 0.2F) << row.id;
    EXPECT_GT(*high, 0.9F) << row.id;
    // 236 m to 1076 m, the first sample at 483 m.
    if (row.id == "jacksboro") {
      EXPECT_FLOAT_EQ(heights.at(0, 0), (483.0F - 236.0F) / (1076.0F - 236.0F));
    }
  }
}

TEST(NormalMap, IsUprightOnFlatGroundAndTiltsAgainstTheSlope) {
  const Heightfield flat{.width = 4, .height = 3, .texels = std::vector<float>(12, 0.5F)};
  const std::vector<std::uint8_t> upright = normal_map(flat, Wrap::repeat, 1.0);
  ASSERT_EQ(upright.size(), 48U);
  EXPECT_THAT(std::vector(upright.begin(), upright.begin() + 4), ElementsAre(128, 128, 255, 255));

  // h rises by 1/4 a texel in x: dh/du = 1, so 45 degrees at a depth of 1.
  Heightfield ramp{.width = 4, .height = 4, .texels = {}};
  for (int i = 0; i < 16; ++i) ramp.texels.push_back(static_cast<float>(i % 4) / 4);
  const auto texel = [&](int x, Wrap wrap, double depth) {
    const std::vector<std::uint8_t> map = normal_map(ramp, wrap, depth);
    const auto at = map.begin() + (4 + x) * 4;
    return std::vector(at, at + 4);
  };
  const auto byte = [](double c) { return static_cast<std::uint8_t>(std::lround((c * 0.5 + 0.5) * 255)); };
  EXPECT_THAT(texel(1, Wrap::clamp, 1.0), ElementsAre(byte(-std::sqrt(0.5)), 128, byte(std::sqrt(0.5)), 255));
  EXPECT_THAT(texel(1, Wrap::clamp, 0.0), ElementsAre(128, 128, 255, 255));
  EXPECT_THAT(texel(1, Wrap::clamp, 2.0), ElementsAre(byte(-2 / std::sqrt(5.0)), 128, byte(1 / std::sqrt(5.0)), 255));
  // The edge: half the slope with clamp, the drop of the seam with repeat.
  EXPECT_THAT(texel(0, Wrap::clamp, 1.0),
              ElementsAre(byte(-0.5 / std::sqrt(1.25)), 128, byte(1 / std::sqrt(1.25)), 255));
  EXPECT_THAT(texel(0, Wrap::repeat, 1.0), ElementsAre(byte(std::sqrt(0.5)), 128, byte(std::sqrt(0.5)), 255));
}

TEST(NormalMap, ScalesWithTheTexelsOfEachSide) {
  Heightfield ramp{.width = 2, .height = 8, .texels = {}};
  for (int i = 0; i < 16; ++i) ramp.texels.push_back(static_cast<float>(i / 2) / 8);
  const std::vector<std::uint8_t> map = normal_map(ramp, Wrap::clamp, 1.0);
  const auto at = map.begin() + 4 * 2 * 4;
  EXPECT_EQ(at[0], 128);
  EXPECT_EQ(at[1], std::lround((-std::sqrt(0.5) * 0.5 + 0.5) * 255));
}

}  // namespace
}  // namespace reliefbench
