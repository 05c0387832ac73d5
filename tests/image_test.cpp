#include "kernels/image/image.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct LosslessCase {
  const char* extension;
  int channels;
  OIIO::TypeDesc type;
  int codes;
};

class LosslessFormat : public ::testing::TestWithParam<LosslessCase> {};

// 300 x 220 texels hold all 65536 codes of 16 bits.
TEST_P(LosslessFormat, ReadsEveryCodeCorrectlyRounded) {
  const LosslessCase& param = GetParam();
  const TempFolder folder;
  const auto path = folder / (std::string("map.") + param.extension);
  const TestImage written{300, 220, param.channels, param.type,
                          code_ramp(std::size_t{300} * 220 * static_cast<std::size_t>(param.channels), param.codes)};
  write_image(path, written);
  const Image image = load_image(path);
  EXPECT_EQ(image.width, 300);
  EXPECT_EQ(image.height, 220);
  EXPECT_EQ(image.channels.size(), static_cast<std::size_t>(param.channels));
  EXPECT_EQ(image.alpha, param.channels == 4 ? 3 : -1);
  EXPECT_TRUE(image.pixels == written.pixels);
}

INSTANTIATE_TEST_SUITE_P(
    All, LosslessFormat,
    ::testing::Values(
        LosslessCase{"png", 1, OIIO::TypeDesc::UINT8, 256}, LosslessCase{"png", 1, OIIO::TypeDesc::UINT16, 65536},
        LosslessCase{"png", 4, OIIO::TypeDesc::UINT8, 256}, LosslessCase{"png", 4, OIIO::TypeDesc::UINT16, 65536},
        LosslessCase{"tif", 1, OIIO::TypeDesc::UINT16, 65536}, LosslessCase{"tif", 3, OIIO::TypeDesc::UINT8, 256},
        LosslessCase{"tif", 1, OIIO::TypeDesc::FLOAT, 65536}, LosslessCase{"exr", 1, OIIO::TypeDesc::FLOAT, 65536},
        LosslessCase{"exr", 4, OIIO::TypeDesc::FLOAT, 65536}, LosslessCase{"tga", 1, OIIO::TypeDesc::UINT8, 256},
        LosslessCase{"tga", 3, OIIO::TypeDesc::UINT8, 256}, LosslessCase{"tga", 4, OIIO::TypeDesc::UINT8, 256},
        LosslessCase{"pgm", 1, OIIO::TypeDesc::UINT8, 256}),
    [](const auto& test) {
      return fmt::format("{}_{}_{}", test.param.extension, test.param.channels, test.param.type.c_str());
    });

TEST(Image, ReadsEveryCodeOf16BitPgm) {
  const TempFolder folder;
  std::string bytes = "P5\n# all codes\n256 256\n65535\n";
  for (int code = 0; code < 65536; ++code) bytes.append({static_cast<char>(code >> 8), static_cast<char>(code & 255)});
  write_bytes(folder / "map.pgm", bytes);
  EXPECT_TRUE(load_image(folder / "map.pgm").pixels == code_ramp(65536, 65536));
}

TEST(Image, PgmMaximumIsOne) {
  const TempFolder folder;
  write_bytes(folder / "map.pgm", std::string("P5 #c\n2 2 100\n") + std::string("\x00\x19\x32\x64", 4));
  EXPECT_THAT(load_image(folder / "map.pgm").pixels, ElementsAre(0, 0.25F, 0.5F, 1));
  for (const char* header : {"P5\n", "P5\n2", "P5\n2 2\n", "P5\n2 x 255\n", "P5\n2 2 70000\n....", "P5\n-2 2 255\n....",
                             "P5\n2 2 99999999999999\n....", "P5\n2 2 255"}) {
    write_bytes(folder / "map.pgm", header);
    EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.pgm"); }), HasSubstr("the PGM header is broken"))
        << header;
  }
  write_bytes(folder / "map.pgm", "P5\n2000000000 2000000000 65535\n....");
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.pgm"); }), EndsWith("the PGM is truncated"));
}

TEST(Image, ReadsWebpNearly) {  // WebP is lossy here
  const TempFolder folder;
  write_image(folder / "map.webp", {16, 16, 3, OIIO::TypeDesc::UINT8, std::vector<float>(16 * 16 * 3, 0.5F)});
  const Image image = load_image(folder / "map.webp");
  EXPECT_THAT(image.pixels, ::testing::SizeIs(16 * 16 * 3));
  EXPECT_THAT(image.pixels, ::testing::Each(::testing::FloatNear(0.5F, 0.02F)));
}

TEST(Image, KeepsDenormalsAndSpecialValuesOfFloats) {
  const TempFolder folder;
  const float denormal = std::numeric_limits<float>::denorm_min();
  const float infinity = std::numeric_limits<float>::infinity();
  write_image(folder / "map.exr", {2, 2, 1, OIIO::TypeDesc::FLOAT, {denormal, -3.0F, infinity, 1e-39F}});
  EXPECT_THAT(load_image(folder / "map.exr").pixels, ElementsAre(denormal, -3.0F, infinity, 1e-39F));
}

TEST(Image, IsNamedByItsContentNotItsExtension) {
  const TempFolder folder;
  write_image(folder / "map.png", {2, 2, 1, OIIO::TypeDesc::UINT8, {0, 0.2F, 0.4F, 1}});
  for (const char* name : {"map.tga", "map", "map.exr"}) {
    std::filesystem::copy_file(folder / "map.png", folder / name);
    EXPECT_EQ(load_image(folder / name).pixels, load_image(folder / "map.png").pixels) << name;
  }
}

class Truncated : public ::testing::TestWithParam<const char*> {};

// A TGA's last 600 bytes are its optional footer, without which it is a whole older TGA.
TEST_P(Truncated, IsRefusedAtEveryLength) {
  const TempFolder folder;
  const auto path = folder / (std::string("map.") + GetParam());
  const int channels = std::string(GetParam()) == "pgm" ? 1 : 3;
  write_image(path, {16, 12, channels, OIIO::TypeDesc::UINT8, code_ramp(16 * 12 * 3, 251)});
  const std::string whole = read_bytes(path);
  const bool is_tga = std::string(GetParam()) == "tga";
  const std::size_t needed = is_tga ? 18 + 16 * 12 * 3 : whole.size();
  for (std::size_t size = 0; size < needed; size += size + 24 < needed ? 61 : 1) {
    write_bytes(path, whole.substr(0, size));
    const std::string message = input_error([&] { (void)load_image(path); });
    EXPECT_THAT(message, StartsWith(path.string() + ": ")) << size;
    EXPECT_THAT(message, ::testing::Not(EndsWith(": "))) << size;
  }
  write_bytes(path, whole);
  EXPECT_EQ(load_image(path).width, 16);
}

INSTANTIATE_TEST_SUITE_P(All, Truncated, ::testing::Values("png", "tga", "tif", "exr", "webp", "ppm", "pgm"),
                         [](const auto& test) { return std::string(test.param); });

TEST(Image, RefusesPngWithAFlippedBit) {
  const TempFolder folder;
  write_image(folder / "map.png", {16, 16, 1, OIIO::TypeDesc::UINT16, code_ramp(256, 65536)});
  std::string bytes = read_bytes(folder / "map.png");
  bytes[bytes.find("IDAT") + 20] ^= 1;
  write_bytes(folder / "map.png", bytes);
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.png"); }), HasSubstr("the PNG is corrupt"));
}

TEST(Image, RefusesWhatIsNoImage) {
  const TempFolder folder;
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "none.png"); }), EndsWith("none.png: no such file"));
  EXPECT_THAT(input_error([&] { (void)load_image(folder.path()); }), EndsWith(": is not a file"));
  write_bytes(folder / "notes.png", "These are notes,\nnot pixels.\n");
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "notes.png"); }), HasSubstr("not a readable image"));
  write_bytes(folder / "empty", "");
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "empty"); }), HasSubstr("not a readable image"));
}

TEST(Image, RefusesSidesUnderTwoAndOverTheLimit) {
  const TempFolder folder;
  const auto path = folder / "map.tif";
  const auto message = [&](int width, int height) {
    const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    write_image(path, {width, height, 1, OIIO::TypeDesc::UINT8, std::vector<float>(count)});
    return input_error([&] { (void)load_image(path); });
  };
  EXPECT_THAT(message(1, 1), HasSubstr("is 1x1 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(1, 7), HasSubstr("is 1x7 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(7, 1), HasSubstr("is 7x1 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(kMaxSide + 1, 2), HasSubstr("is 16385x2 texels; at most 16384 a side"));
}

RC_GTEST_PROP(Png, EncodedBytesDecodeToTheSamePixels, ()) {
  const int width = *rc::gen::inRange(2, 20);
  const int height = *rc::gen::inRange(2, 20);
  const auto count = static_cast<std::size_t>(width * height * 4);
  const auto pixels = *rc::gen::container<std::vector<std::uint8_t>>(count, rc::gen::arbitrary<std::uint8_t>());
  const TempFolder folder;
  write_png(folder / "frame.png", width, height, pixels);
  const std::vector<std::uint8_t> bytes = encode_png(width, height, pixels);
  RC_ASSERT(read_bytes(folder / "frame.png") == std::string(bytes.begin(), bytes.end()));
  const Image image = load_image(folder / "frame.png");
  RC_ASSERT(image.width == width);
  RC_ASSERT(image.alpha == 3);
  for (std::size_t i = 0; i < count; ++i) RC_ASSERT(image.pixels[i] == static_cast<float>(pixels[i]) / 255.0F);
}

TEST(Png, ReplacesTheFileAndLeavesNothingElse) {
  const TempFolder folder;
  write_bytes(folder / "frame.png", "an older file");
  write_png(folder / "frame.png", 2, 2, std::vector<std::uint8_t>(16, 255));
  EXPECT_EQ(load_image(folder / "frame.png").pixels, std::vector<float>(16, 1.0F));
  const auto files = std::filesystem::directory_iterator(folder.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(Png, NamesThePathThatCannotBeWritten) {
  const TempFolder folder;
  try {
    write_png(folder / "missing/frame.png", 2, 2, std::vector<std::uint8_t>(16));
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("missing/frame.png: cannot be written"));
  }
}

}  // namespace
}  // namespace reliefbench
