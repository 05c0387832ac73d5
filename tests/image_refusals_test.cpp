// Files that are no images, are broken, or would take more memory than they are worth.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <zlib.h>

#include <span>

#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/image.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Found by fuzzing: a byte behind the texels was read.
TEST(Tga, a_palette_without_entries_has_no_colour) {
  const TempFolder folder;
  std::string tga(18 + 4, '\0');
  tga[1] = tga[2] = 1;    // a palette, and indices
  tga[7] = 24;            // bits of its entries, of which there are none
  tga[12] = tga[14] = 2;  // sides
  tga[16] = 8;
  write_bytes(folder / "x.tga", tga);
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "x.tga"); }),
              HasSubstr("has no colour in the TGA's palette"));
}

// It may be one height of 16 bits, or one of 8 with 8 undefined bits: its low byte alone was read.
TEST(Tga, of_16_grey_bits_says_what_they_are) {
  const TempFolder folder;
  std::string tga(18 + 8, '\0');
  tga[2] = 3;             // greys
  tga[12] = tga[14] = 2;  // sides
  tga[16] = 16;
  write_bytes(folder / "x.tga", tga);
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "x.tga"); }),
              EndsWith("x.tga: a grey TGA of 16 bits without alpha: expected 8 bits, or 8 and 8 of alpha"));
  tga[17] = 8;
  write_bytes(folder / "x.tga", tga);
  EXPECT_EQ(load_image(folder / "x.tga").alpha, 1);
}

class Truncated : public ::testing::TestWithParam<const char*> {};

TEST_P(Truncated, IsRefusedAtEveryLength) {
  const TempFolder folder;
  const auto path = folder / (std::string("map.") + GetParam());
  const int channels = std::string(GetParam()) == "pgm" ? 1 : 3;
  write_image(path, {16, 12, channels, TexelType::unorm8,
                     code_ramp(std::size_t{16} * 12 * static_cast<std::size_t>(channels), 251)});
  const std::string whole = read_bytes(path);
  for (std::size_t size = 0; size < whole.size(); size += size + 24 < whole.size() ? 61 : 1) {
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
  write_image(folder / "map.png", {16, 16, 1, TexelType::unorm16, code_ramp(256, 65536)});
  std::string bytes = read_bytes(folder / "map.png");
  bytes[bytes.find("IDAT") + 20] ^= 1;
  write_bytes(folder / "map.png", bytes);
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.png"); }), HasSubstr("the PNG is corrupt"));
}

TEST(Image, RefusesAnExrAttributeLongerThanItsFile) {
  using namespace std::string_literals;
  const TempFolder folder;
  const std::string good = "compression\0compression\0\1\0\0\0\0"s;
  const std::string bad = "owner\0string\0\xff\xff\xff\x7fme"s;
  const std::string one = "v/1\1\2\0\0\0"s + good + bad;
  const std::string second_of_two = "v/1\1\2\x10\0\0"s + good + "\0"s + good + bad;
  for (const std::string& file : {one, second_of_two}) {
    write_bytes(folder / "map.exr", file);
    EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.exr"); }),
                EndsWith("map.exr: the EXR is truncated or corrupt: an attribute claims 2147483647 bytes, 2 are left"));
  }
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

TEST(Image, RefusesFormatsThatNobodyAskedFor) {
  const TempFolder folder;
  const std::string zeros(100, '\0');
  for (const auto& [name, start] : std::vector<std::pair<std::string, std::string>>{{"map.gif", "GIF89a"},
                                                                                    {"map.psd", "8BPS"},
                                                                                    {"map.hdr", "#?RADIANCE\n"},
                                                                                    {"map.bmp", "BM"},
                                                                                    {"map.jpg", "\xff\xd8\xff"},
                                                                                    {"map.null", ""},
                                                                                    {"map.null?RES=64x64", ""}}) {
    const std::filesystem::path path = folder / name;
    write_bytes(path, start + zeros);
    EXPECT_EQ(input_error([&] { (void)load_image(path); }),
              path.string() + ": not a readable image: PNG, TIFF, EXR, WebP, TGA, PGM and PPM are read");
  }
  EXPECT_EQ(input_error([] { (void)load_image("/dev/zero"); }), "/dev/zero: is not a file");
}

TEST(Image, RefusesTooManyChannelsAndNone) {
  const TempFolder folder;
  std::vector<std::string> channels;
  for (int i = 0; i < 1000; ++i) channels.push_back(fmt::format("C{}", i));
  const std::vector<float> pixels(4 * channels.size());
  write_bytes(folder / "map.exr", encode_exr({.width = 2,
                                              .height = 2,
                                              .type = TexelType::float32,
                                              .channels = channels,
                                              .pixels = std::as_bytes(std::span(pixels))}));
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.exr"); }),
              EndsWith("map.exr: has 1000 channels; at most 256 are read"));
  EXPECT_EQ(input_error([] { check_shape(4, 4, 0, "x"); }), "x: has no channels");
}

// OpenEXR reads by the type: it would take the bytes behind for a text of 1.7 GB (found by fuzzing).
TEST(Image, RefusesAnExrAttributeThatIsNotAsLongAsItsType) {
  using namespace std::string_literals;
  const TempFolder folder;
  for (const auto& [type, value] : std::vector<std::pair<std::string, std::string>>{
           {"compression", "\0\0"s},
           {"chlist", "Y\0 sixteen bytes..."s},
           {"chlist", "Y\0\1\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0\0more"s},
           {"preview", "\0\0\1\0\0\0\1\0four"s},
           {"stringvector", "\1\0\0\0a\xff\0\0\0b"s},
       }) {
    const auto size = static_cast<char>(value.size());
    write_bytes(folder / "map.exr", "v/1\1\2\0\0\0name\0"s + type + "\0"s + size + "\0\0\0"s + value + "\0\0\0\0"s);
    EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.exr"); }),
                HasSubstr(fmt::format("an attribute of type {} has {} bytes", type, value.size())));
  }
}

// OpenEXR takes memory for a row of tiles, of which the file may claim any size: found by fuzzing, 3 GB for 754 bytes.
TEST(Image, RefusesAnExrWhoseTilesDwarfIt) {
  const TempFolder folder;
  std::string file =
      read_bytes(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data/images/tiled_zip_float.exr");
  const std::size_t tiles = file.find("tiledesc") + sizeof("tiledesc") + 4;  // after its size
  file.replace(tiles + 4, 4, std::string("\0\0\xc6\0", 4));
  write_bytes(folder / "map.exr", file);
  EXPECT_THAT(input_error([&] { (void)load_image(folder / "map.exr"); }), HasSubstr("texels in tiles of "));
}

/// Most memory that this process ever had, in MiB.
long peak_memory_mib() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

/// A PNG whose header promises 16384 x 16384 texels, with the data of a few.
std::string huge_png(char colour_type) {
  const auto chunk = [](std::string text) {
    const auto word = [](std::size_t value) {
      return std::string{static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
                         static_cast<char>(value)};
    };
    const std::size_t sum = crc32_z(0, reinterpret_cast<const Bytef*>(text.data()), text.size());
    return word(text.size() - 4) + text + word(sum);
  };
  const std::string side("\0\0\x40\0", 4);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR" + side + side + std::string{8, colour_type, 0, 0, 0}) +
         chunk("IDAT" + std::string("\x78\x9c\x63\x60\x60\x60\x00", 7)) + chunk("IEND");
}

TEST(Image, AHeaderAloneTakesNoMemory) {
  const TempFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    write_bytes(folder / name, bytes);
    return input_error([&] { (void)load_image(folder / name); });
  };
  const std::string tga_header = std::string("\0\0\x0b\0\0\0\0\0\0\0\0\0\0\x40\0\x40\x08\0", 18);
  const long before = peak_memory_mib();
  EXPECT_THAT(refusal("rgba.png", huge_png(6)),
              HasSubstr("16384x16384 texels with 4 channels take 4.0 GiB decoded; at most 2 GiB are read"));
  EXPECT_THAT(refusal("grey.png", huge_png(0)), HasSubstr("the PNG is corrupt"));
  EXPECT_THAT(refusal("grey.pgm", "P5 16384 16384 65535\n...."), EndsWith("the PGM is truncated"));
  EXPECT_THAT(refusal("grey.tga", tga_header + "\xff\x10"), EndsWith("the TGA is truncated"));
  EXPECT_LT(peak_memory_mib() - before, 64);
}

TEST(Image, RefusesSidesUnderTwoAndOverTheLimit) {
  const TempFolder folder;
  const auto path = folder / "map.tif";
  const auto message = [&](int width, int height) {
    const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    write_image(path, {width, height, 1, TexelType::unorm8, std::vector<float>(count)});
    return input_error([&] { (void)load_image(path); });
  };
  EXPECT_THAT(message(1, 1), HasSubstr("is 1x1 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(1, 7), HasSubstr("is 1x7 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(7, 1), HasSubstr("is 7x1 texels; at least 2x2 is needed"));
  EXPECT_THAT(message(kMaxSide + 1, 2), HasSubstr("is 16385x2 texels; at most 16384 a side"));
}

}  // namespace
}  // namespace reliefbench
