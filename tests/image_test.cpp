#include "kernels/image/image.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <span>

#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;

struct LosslessCase {
  const char* extension;
  int channels;
  TexelType type;
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
    ::testing::Values(LosslessCase{"png", 1, TexelType::unorm8, 256}, LosslessCase{"png", 1, TexelType::unorm16, 65536},
                      LosslessCase{"png", 4, TexelType::unorm8, 256}, LosslessCase{"png", 4, TexelType::unorm16, 65536},
                      LosslessCase{"tif", 1, TexelType::unorm16, 65536}, LosslessCase{"tif", 3, TexelType::unorm8, 256},
                      LosslessCase{"tif", 1, TexelType::float32, 65536},
                      LosslessCase{"exr", 1, TexelType::float32, 65536},
                      LosslessCase{"exr", 4, TexelType::float32, 65536}, LosslessCase{"tga", 1, TexelType::unorm8, 256},
                      LosslessCase{"tga", 3, TexelType::unorm8, 256}, LosslessCase{"tga", 4, TexelType::unorm8, 256},
                      LosslessCase{"pgm", 1, TexelType::unorm8, 256}, LosslessCase{"ppm", 3, TexelType::unorm8, 256},
                      LosslessCase{"webp", 3, TexelType::unorm8, 256}),
    [](const auto& test) {
      return fmt::format("{}_{}_{}", test.param.extension, test.param.channels, texel_type_id(test.param.type));
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
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.pgm"); }), EndsWith("at most 16384 a side is possible"));
  write_bytes(folder / "map.pgm", "P5\n2000 2000 65535\n....");
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.pgm"); }), EndsWith("the PGM is truncated"));
}

TEST(Image, ReadsTextPgmAndPpm) {
  const TempFolder folder;
  write_bytes(folder / "map.pgm", "P2\n# by hand\n3 2\n4\n0 1 2\n3 4 # last\n 2");
  EXPECT_THAT(load_image(folder / "map.pgm").pixels, ElementsAre(0, 0.25F, 0.5F, 0.75F, 1, 0.5F));
  write_bytes(folder / "map.ppm", "P3 2 2 1  0 0 1  0 1 0  1 0 0  1 1 1");
  EXPECT_THAT(load_image(folder / "map.ppm").pixels, ElementsAre(0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1));
  write_bytes(folder / "map.pgm", "P2 3 2 4 0 1 2 3 4 x2");
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.pgm"); }), HasSubstr("5 of 6 numbers are there"));
}

/// A file of tests/data/images and what it shows. OpenImageIO 2.4 wrote them, but for what it cannot write (interlaced
/// rows, palettes, 4 bits), which was put together by hand.
struct ForeignFile {
  const char* name;
  const char* sample;
  const char* channels;
  float (*value)(int x, int y, int channel);
};

int foreign_code(int x, int y, int channel, int codes) {
  return (x * 3701 + y * 10007 + channel * 5903 + x * y * 17) % codes;
}
template <int codes>
float foreign_value(int x, int y, int channel) {
  return static_cast<float>(foreign_code(x, y, channel, codes)) / static_cast<float>(codes - 1);
}
float foreign_signed(int x, int y, int channel) {
  return static_cast<float>(foreign_code(x, y, channel, 32768)) * (1.0F / 32767.0F);
}
float foreign_half(int x, int y, int channel) {
  return value_of(nearest_code(foreign_value<256>(x, y, channel), TexelType::float16), TexelType::float16);
}
float foreign_palette(int x, int y, int channel) { return foreign_value<256>((x + y) % 16, 0, channel); }

class Foreign : public ::testing::TestWithParam<ForeignFile> {};

TEST_P(Foreign, IsReadAsItWasWritten) {
  const ForeignFile& file = GetParam();
  const Image image = load_image(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data/images" / file.name);
  EXPECT_EQ(image.width, 19);
  EXPECT_EQ(image.height, 11);
  EXPECT_EQ(image.sample, file.sample);
  EXPECT_EQ(fmt::format("{}", fmt::join(image.channels, "")), file.channels);
  EXPECT_EQ(image.alpha, static_cast<int>(std::string(file.channels).find('A')));
  ASSERT_EQ(image.pixels.size(), 19 * 11 * image.channels.size());
  const int channels = static_cast<int>(image.channels.size());
  for (int i = 0; i < static_cast<int>(image.pixels.size()); ++i) {
    const int texel = i / channels;
    ASSERT_EQ(image.pixels[static_cast<std::size_t>(i)], file.value(texel % 19, texel / 19, i % channels))
        << "texel " << texel << " channel " << i % channels;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Foreign,
                         ::testing::Values(ForeignFile{"grey_4.png", "4-bit", "Y", foreign_value<16>},
                                           ForeignFile{"grey_alpha_16.png", "16-bit", "YA", foreign_value<65536>},
                                           ForeignFile{"interlaced_16.png", "16-bit", "Y", foreign_value<65536>},
                                           ForeignFile{"palette_4.png", "4-bit", "RGB", foreign_palette},
                                           ForeignFile{"tiled_lzw_16.tif", "16-bit", "RGB", foreign_value<65536>},
                                           ForeignFile{"planes_deflate_float.tif", "float", "RGB",
                                                       foreign_value<65536>},
                                           ForeignFile{"signed_16.tif", "signed 16-bit", "Y", foreign_signed},
                                           ForeignFile{"white_is_zero_8.tif", "8-bit", "Y", foreign_value<256>},
                                           ForeignFile{"piz_half.exr", "half-float", "RGBA", foreign_half},
                                           ForeignFile{"tiled_zip_float.exr", "float", "Y", foreign_value<65536>},
                                           ForeignFile{"packets_rgba.tga", "8-bit", "RGBA", foreign_value<256>},
                                           ForeignFile{"packets_grey.tga", "8-bit", "Y", foreign_value<256>},
                                           ForeignFile{"palette.tga", "8-bit", "RGB", foreign_palette}),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST(Image, KeepsDenormalsAndSpecialValuesOfFloats) {
  const TempFolder folder;
  const float denormal = std::numeric_limits<float>::denorm_min();
  const float infinity = std::numeric_limits<float>::infinity();
  write_image(folder / "map.exr", {2, 2, 1, TexelType::float32, {denormal, -3.0F, infinity, 1e-39F}});
  EXPECT_THAT(load_image(folder / "map.exr").pixels, ElementsAre(denormal, -3.0F, infinity, 1e-39F));
}

TEST(Image, IsNamedByItsContentNotItsExtension) {
  const TempFolder folder;
  write_image(folder / "map.png", {2, 2, 1, TexelType::unorm8, {0, 0.2F, 0.4F, 1}});
  for (const char* name : {"map.tga", "map", "map.exr"}) {
    std::filesystem::copy_file(folder / "map.png", folder / name);
    EXPECT_EQ(load_image(folder / name).pixels, load_image(folder / "map.png").pixels) << name;
  }
}

TEST(Exr, alpha_is_behind_what_may_be_heights) {
  const TempFolder folder;
  for (const std::string height : {"Z", "height", "relief.Z"}) {
    const std::vector<float> pixels{1, 0.25F, 1, 0.75F, 1, 0.5F, 1, 0};
    write_bytes(folder / "map.exr", encode_exr({.width = 2,
                                                .height = 2,
                                                .type = TexelType::float32,
                                                .channels = {"A", height},
                                                .pixels = std::as_bytes(std::span(pixels))}));
    const Image image = load_image(folder / "map.exr");
    EXPECT_EQ(image.alpha, 1) << height;
    EXPECT_THAT(image.pixels, ElementsAre(0.25F, 1, 0.75F, 1, 0.5F, 1, 0, 1)) << height;
  }
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

TEST(Png, IsNotWrittenOfPixelsThatAreNotThere) {
  for (const std::size_t bytes : {0, 12, 15, 17, 32})
    EXPECT_THROW((void)encode_png(2, 2, std::vector<std::uint8_t>(bytes)), Error) << bytes;
}

}  // namespace
}  // namespace reliefbench
