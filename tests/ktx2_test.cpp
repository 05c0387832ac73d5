#include "kernels/image/ktx2.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cstring>

#include "kernels/base/atomic_file.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TextureImage counting_image(int width, int height, TexelLayout layout, int levels) {
  TextureImage image{.width = width, .height = height, .layout = layout, .levels = levels};
  std::size_t bytes = 0;
  for (int level = 0; level < levels; ++level)
    bytes += static_cast<std::size_t>(level_side(width, level) * level_side(height, level) * layout.bytes());
  for (std::size_t i = 0; i < bytes; ++i) image.texels.push_back(static_cast<std::byte>(7 * i + 1));
  return image;
}

std::uint32_t word(const std::string& file, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, file.data() + at, sizeof(value));
  return value;
}

std::uint64_t long_word(const std::string& file, std::size_t at) {
  return word(file, at) | (static_cast<std::uint64_t>(word(file, at + 4)) << 32U);
}

// The layout by hand from the KTX 2.0 specification: header 80 bytes, level index 24 a level, descriptor, metadata,
// levels from the smallest.
TEST(Ktx2, LiesAsTheSpecificationHasIt) {
  const TextureImage image = counting_image(5, 3, {.type = TexelType::unorm16, .channels = 2}, 3);
  const std::string file = encode_ktx2({.image = image, .metadata = {{"b", "two"}, {"a", "one"}}});
  EXPECT_THAT(file, StartsWith("\xABKTX 20\xBB\r\n\x1A\n"));
  EXPECT_EQ(word(file, 12), 77U);  // VK_FORMAT_R16G16_UNORM
  EXPECT_EQ(word(file, 16), 2U);   // bytes of the type
  EXPECT_EQ(word(file, 20), 5U);
  EXPECT_EQ(word(file, 24), 3U);
  EXPECT_EQ(word(file, 28), 0U);  // depth
  EXPECT_EQ(word(file, 32), 0U);  // layers
  EXPECT_EQ(word(file, 36), 1U);  // faces
  EXPECT_EQ(word(file, 40), 3U);  // levels
  EXPECT_EQ(word(file, 44), 0U);  // supercompression
  const std::size_t descriptor = word(file, 48);
  EXPECT_EQ(descriptor, 80U + 3 * 24U);
  EXPECT_EQ(word(file, 52), 4U + 24 + 2 * 16);
  EXPECT_EQ(word(file, descriptor), 4U + 24 + 2 * 16);
  EXPECT_EQ(word(file, descriptor + 12), 1U | (1U << 16U));  // RGBSDA, linear
  EXPECT_EQ(word(file, descriptor + 20), 4U);                // bytes a texel
  EXPECT_EQ(word(file, descriptor + 28), 15U << 16U);        // red, bits 0 to 15
  EXPECT_EQ(word(file, descriptor + 40), 65535U);
  EXPECT_EQ(word(file, descriptor + 44), 16U | (15U << 16U) | (1U << 24U));  // green, bits 16 to 31
  const std::size_t metadata = word(file, 56);
  EXPECT_EQ(metadata, descriptor + word(file, 52));
  EXPECT_EQ(file.substr(metadata, word(file, 60)), std::string("\6\0\0\0a\0one\0\0\0\6\0\0\0b\0two\0\0\0", 24));
  // Levels of 5x3, 2x1 and 1x1 texels of 4 bytes.
  std::uint64_t end = metadata + word(file, 60);
  std::size_t texel_end = image.texels.size();
  for (const int level : {2, 1, 0}) {
    const std::size_t index = 80 + 24 * static_cast<std::size_t>(level);
    const std::uint64_t offset = long_word(file, index);
    const std::uint64_t size = long_word(file, index + 8);
    EXPECT_EQ(offset, end);
    EXPECT_EQ(offset % 4, 0U);
    EXPECT_EQ(size, level == 0 ? 60U : (level == 1 ? 8U : 4U));
    EXPECT_EQ(long_word(file, index + 16), size);
    texel_end -= size;
    EXPECT_EQ(std::memcmp(file.data() + offset, image.texels.data() + texel_end, size), 0);
    end = offset + size;
  }
  EXPECT_EQ(end, file.size());
}

TEST(Ktx2, FloatsSaySo) {
  const TextureImage image = counting_image(2, 2, {.type = TexelType::float16, .channels = 4}, 1);
  const std::string file = encode_ktx2({.image = image});
  EXPECT_EQ(word(file, 12), 97U);  // VK_FORMAT_R16G16B16A16_SFLOAT
  EXPECT_EQ(word(file, 56), 0U) << "no metadata, no offset";
  const std::size_t alpha = word(file, 48) + 28 + 3 * 16;
  EXPECT_EQ(word(file, alpha), 48U | (15U << 16U) | (0xCFU << 24U));  // alpha, signed float
  EXPECT_EQ(word(file, alpha + 8), std::bit_cast<std::uint32_t>(-1.0F));
  EXPECT_EQ(word(file, alpha + 12), std::bit_cast<std::uint32_t>(1.0F));
}

TEST(Ktx2, BlocksSaySo) {
  TextureImage image{.width = 9, .height = 5, .layout = {.type = TexelType::rgtc, .channels = 2}, .levels = 4};
  image.texels.resize(image_bytes(image), std::byte{3});
  const std::string file = encode_ktx2({.image = image});
  EXPECT_EQ(word(file, 12), 141U);  // VK_FORMAT_BC5_UNORM_BLOCK
  EXPECT_EQ(word(file, 16), 1U);
  const std::size_t descriptor = word(file, 48);
  EXPECT_EQ(word(file, descriptor + 12), 132U | (1U << 16U));                // model BC5, linear
  EXPECT_EQ(word(file, descriptor + 16), 0x0303U);                           // of 4 x 4
  EXPECT_EQ(word(file, descriptor + 20), 16U);                               // bytes a block
  EXPECT_EQ(word(file, descriptor + 28), 63U << 16U);                        // red, 64 bits
  EXPECT_EQ(word(file, descriptor + 44), 64U | (63U << 16U) | (1U << 24U));  // green
  EXPECT_EQ(word(file, descriptor + 40), ~0U);
  EXPECT_EQ(long_word(file, 80 + 8), 96U);  // 3 x 2 blocks
  EXPECT_EQ(long_word(file, 80) % 16, 0U);
  EXPECT_EQ(decode_ktx2(std::as_bytes(std::span(file)), "x").image.texels, image.texels);
}

TEST(Ktx2, BlocksOfEacAreEtc2s) {
  for (const int channels : {1, 2}) {
    TextureImage image{.width = 9, .height = 5, .layout = {.type = TexelType::eac, .channels = channels}};
    image.texels.resize(image_bytes(image), std::byte{3});
    const std::string file = encode_ktx2({.image = image});
    EXPECT_EQ(word(file, 12), channels == 1 ? 153U : 155U);  // VK_FORMAT_EAC_R11(G11)_UNORM_BLOCK
    EXPECT_EQ(word(file, 16), 1U);
    const std::size_t descriptor = word(file, 48);
    EXPECT_EQ(word(file, descriptor + 12), 161U | (1U << 16U));  // model ETC2, linear
    EXPECT_EQ(word(file, descriptor + 16), 0x0303U);
    EXPECT_EQ(word(file, descriptor + 20), 8U * static_cast<unsigned>(channels));
    EXPECT_EQ(word(file, descriptor + 28), 63U << 16U);
    EXPECT_EQ(decode_ktx2(std::as_bytes(std::span(file)), "x").image.texels, image.texels);
  }
}

TEST(Ktx2, BlocksOfBothChannelsAreOneSample) {
  for (const TexelType type : {TexelType::bc7, TexelType::astc}) {
    const bool is_astc = type == TexelType::astc;
    TextureImage image{.width = 9, .height = 5, .layout = {.type = type, .channels = 2}, .levels = 4};
    image.texels.resize(image_bytes(image), std::byte{3});
    const std::string file = encode_ktx2({.image = image});
    EXPECT_EQ(word(file, 12), is_astc ? 157U : 145U);  // VK_FORMAT_ASTC_4x4_UNORM_BLOCK, VK_FORMAT_BC7_UNORM_BLOCK
    EXPECT_EQ(word(file, 16), 1U);
    const std::size_t descriptor = word(file, 48);
    EXPECT_EQ(word(file, descriptor), 4U + 24 + 16);
    EXPECT_EQ(word(file, descriptor + 12), (is_astc ? 162U : 134U) | (1U << 16U));  // model ASTC, BC7; linear
    EXPECT_EQ(word(file, descriptor + 16), 0x0303U);
    EXPECT_EQ(word(file, descriptor + 20), 16U);
    EXPECT_EQ(word(file, descriptor + 28), 127U << 16U);
    EXPECT_EQ(word(file, descriptor + 40), ~0U);
    EXPECT_EQ(long_word(file, 80 + 8), 96U);
    const Ktx2File read = decode_ktx2(std::as_bytes(std::span(file)), "x");
    EXPECT_EQ(read.image.texels, image.texels);
    EXPECT_EQ(read.metadata.contains("KTXswizzle"), is_astc);  // ra01: the shader's green is alpha
  }
}

constexpr TexelType kFileTypes[] = {TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32};

TEST(Ktx2, ComesBackBitForBit) {
  const TempFolder folder;
  for (const TexelType type : kFileTypes) {
    for (const int channels : {1, 2, 4}) {
      for (const int levels : {1, 4}) {
        const Ktx2File file{.image = counting_image(13, 6, {.type = type, .channels = channels}, levels),
                            .metadata = {{"KTXwriter", "test"}, {"empty", ""}, {"long", std::string(77, 'x')}}};
        write_atomically(folder / "map.ktx2", encode_ktx2(file));
        const Ktx2File back = read_ktx2(folder / "map.ktx2");
        EXPECT_EQ(back.image.texels, file.image.texels);
        EXPECT_EQ(back.image.layout, file.image.layout);
        EXPECT_EQ(back.image.width, 13);
        EXPECT_EQ(back.image.height, 6);
        EXPECT_EQ(back.image.levels, levels);
        EXPECT_EQ(back.metadata, file.metadata);
        const std::string bytes = read_bytes(folder / "map.ktx2");
        EXPECT_EQ(bytes, encode_ktx2(back));
      }
    }
  }
}

const Ktx2File kSmallFile{.image = counting_image(4, 4, {.type = TexelType::unorm8, .channels = 2}, 3),
                          .metadata = {{"key", "value"}}};

std::string ktx2_refusal(const std::string& bytes) {
  return input_error([&] { (void)decode_ktx2(std::as_bytes(std::span(bytes)), "x.ktx2"); });
}

TEST(Ktx2, EveryCutIsRefused) {
  const std::string whole = encode_ktx2(kSmallFile);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THAT(ktx2_refusal(whole.substr(0, size)), StartsWith("x.ktx2: "));
}

TEST(Ktx2, SaysWhatIsWrong) {
  const std::string whole = encode_ktx2(kSmallFile);
  const auto with = [&](std::size_t at, std::uint32_t value) {
    std::string bytes = whole;
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    return ktx2_refusal(bytes);
  };
  EXPECT_THAT(ktx2_refusal("PNG and more bytes than an identifier"), HasSubstr("not a KTX 2.0 file"));
  EXPECT_THAT(with(12, 23), HasSubstr("VkFormat 23"));
  EXPECT_THAT(with(16, 2), HasSubstr("type size"));
  EXPECT_THAT(with(20, 0), HasSubstr("0 x 4 texels"));
  EXPECT_THAT(with(24, 0xFFFFFFFF), HasSubstr("texels are not possible"));
  EXPECT_THAT(with(28, 2), HasSubstr("2D texture was expected"));
  EXPECT_THAT(with(36, 6), HasSubstr("2D texture was expected"));
  EXPECT_THAT(with(40, 4), HasSubstr("4 mip levels, expected 1 to 3"));
  EXPECT_THAT(with(44, 2), HasSubstr("supercompressed"));
  EXPECT_THAT(with(48, 0xFFFFFFF0), HasSubstr("the format descriptor lies at"));
  EXPECT_THAT(with(60, 0xFFFFFFFF), HasSubstr("the metadata lies at"));
  EXPECT_THAT(with(word(whole, 48) + 12, 1U | (2U << 16U)), HasSubstr("descriptor"));  // sRGB
  EXPECT_THAT(with(word(whole, 56), 0xFFFFFFFF), HasSubstr("does not fit"));
  EXPECT_THAT(with(80 + 4, 0xFFFFFFFF), HasSubstr("a mip level lies at"));  // the offset's high half
  EXPECT_THAT(with(80 + 8, 31), HasSubstr("level 0 has 31 bytes, expected 32"));
  EXPECT_THAT(input_error([] { (void)read_ktx2("/nowhere/x.ktx2"); }), HasSubstr("/nowhere/x.ktx2: cannot be read"));
}

// A property test found it: the levels that were left lay in their places.
TEST(Ktx2, FewerLevelsThanTheIndexHasAreRefused) {
  std::string bytes = encode_ktx2(kSmallFile);
  ASSERT_EQ(bytes[40], 3);
  bytes[40] = 1;
  EXPECT_THAT(ktx2_refusal(bytes), HasSubstr("does not follow an index of 1 mip levels"));
}

RC_GTEST_PROP(Ktx2Property, NoByteThatIsChangedBreaksTheReader, ()) {
  std::string bytes = encode_ktx2(kSmallFile);
  const auto at = *rc::gen::inRange<std::size_t>(0, bytes.size());
  bytes[at] = static_cast<char>(*rc::gen::inRange(0, 256));
  try {
    const Ktx2File file = decode_ktx2(std::as_bytes(std::span(bytes)), "x.ktx2");
    RC_ASSERT(file.image.texels.size() == kSmallFile.image.texels.size());
  } catch (const Error& error) {
    RC_ASSERT(error.code() == Exit::bad_input);
  }
}

}  // namespace
}  // namespace reliefbench
