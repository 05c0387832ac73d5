#include "kernels/texel.h"

#include <Imath/half.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "kernels/error.h"

namespace reliefbench {
namespace {

constexpr std::array kTypes{TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32};

/// All codes for values in [0, 1] are [0, code_of_one].
std::uint32_t code_of_one(TexelType type) {
  switch (type) {
    case TexelType::unorm8:
      return 255;
    case TexelType::unorm16:
      return 65535;
    case TexelType::float16:
      return 0x3c00;
    case TexelType::float32:
      return 0x3f800000;
  }
  return 0;
}

float value(std::uint32_t code, TexelType type) {
  switch (type) {
    case TexelType::unorm8:
      return static_cast<float>(code) / 255.0F;
    case TexelType::unorm16:
      return static_cast<float>(code) / 65535.0F;
    case TexelType::float16: {
      half h;
      h.setBits(static_cast<std::uint16_t>(code));
      return h;
    }
    case TexelType::float32:
      return std::bit_cast<float>(code);
  }
  return 0;
}

/// The cone channel of a 2x2 texture with this one ratio, as its code.
std::uint32_t stored_ratio_code(float ratio, TexelType type, const Encoding& encoding) {
  const auto format = std::find_if(formats().begin(), formats().end(),
                                   [&](const Format& f) { return f.type == type && f.channels == 2; });
  const Heightfield flat{.width = 2, .height = 2, .texels = std::vector<float>(4)};
  const TextureImage image = pack_texture(flat, std::vector<float>(4, ratio), *format, encoding);
  const auto size = static_cast<std::size_t>(format->bytes_per_texel() / 2);
  std::uint32_t code = 0;
  std::memcpy(&code, image.texels.data() + size, size);
  return code;
}

bool is_guarded(float decoded, float ratio) { return std::nextafter(decoded, 2.0F) <= ratio; }

/// A ratio of any magnitude: log-uniform bits in [0, 1].
rc::Gen<float> any_ratio() {
  return rc::gen::map(rc::gen::inRange<std::uint32_t>(0, 0x3f800001),
                      [](std::uint32_t bits) { return std::bit_cast<float>(bits); });
}

RC_GTEST_PROP(FloorRatio, IsTheLargestStorableRatioBelow, ()) {
  const float ratio = *rc::gen::oneOf(
      any_ratio(), rc::gen::map(rc::gen::inRange(0, 1 << 24), [](int i) { return static_cast<float>(i) * 0x1p-24F; }));
  for (const TexelType type : kTypes) {
    for (const Encoding& encoding : encodings()) {
      const float decoded = floor_ratio(ratio, type, encoding);
      const std::uint32_t code = stored_ratio_code(ratio, type, encoding);
      RC_ASSERT(decoded == encoding.decode(value(code, type)));
      RC_ASSERT(decoded <= ratio);
      RC_ASSERT(decoded == 0.0F || is_guarded(decoded, ratio));
      if (code < code_of_one(type)) RC_ASSERT(!is_guarded(encoding.decode(value(code + 1, type)), ratio));
    }
  }
}

TEST(FloorRatio, HoldsAtAndAroundEveryUnormAndHalfCode) {
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16}) {
    for (const Encoding& encoding : encodings()) {
      for (std::uint32_t code = 0; code <= code_of_one(type); ++code) {
        const float exact = encoding.decode(value(code, type));
        const float below = code == 0 ? 0.0F : encoding.decode(value(code - 1, type));
        // The guard takes the code itself; one ulp more than it, and it fits.
        ASSERT_EQ(floor_ratio(exact, type, encoding), below) << encoding.id << code;
        if (exact < 1) {
          ASSERT_EQ(floor_ratio(std::nextafter(exact, 2.0F), type, encoding), exact) << encoding.id << code;
        }
      }
    }
  }
}

TEST(FloorRatio, KeepsZero) {
  for (const TexelType type : kTypes)
    for (const Encoding& encoding : encodings()) EXPECT_EQ(floor_ratio(0.0F, type, encoding), 0.0F);
}

TEST(FloorRatio, LosesOneCodeAtTheClamp) {
  EXPECT_EQ(floor_ratio(1.0F, TexelType::unorm8, find_encoding("ratio")), 254.0F / 255.0F);
  EXPECT_EQ(floor_ratio(1.0F, TexelType::float16, find_encoding("ratio")), 2047.0F / 2048.0F);
}

// The steepest cone of a 256 map is 1/(sqrt2 * 256): 8 bits hold nothing of it, their square root does.
TEST(FloorRatio, EightBitsStallWhereTheirSquareRootDoesNot) {
  const float steepest = 1 / (std::sqrt(2.0F) * 256);
  EXPECT_EQ(floor_ratio(steepest, TexelType::unorm8, find_encoding("ratio")), 0.0F);
  EXPECT_EQ(stored_ratio_code(steepest, TexelType::unorm8, find_encoding("ratio")), 0U);
  EXPECT_EQ(stored_ratio_code(steepest, TexelType::unorm8, find_encoding("sqrt")), 13U);
  EXPECT_GT(floor_ratio(steepest, TexelType::unorm8, find_encoding("sqrt")), 0.9F * steepest);
}

TEST(QuantiseHeights, EveryUnormAndHalfCodeStays) {
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16}) {
    Heightfield codes;
    for (std::uint32_t code = 0; code <= code_of_one(type); ++code) codes.texels.push_back(value(code, type));
    codes.width = static_cast<int>(codes.texels.size());
    codes.height = 1;
    EXPECT_TRUE(quantise_heights(codes, type).texels == codes.texels);
  }
}

RC_GTEST_PROP(QuantiseHeights, TakesTheNearestCode, ()) {
  const float height = *any_ratio();
  const Heightfield field{.width = 1, .height = 1, .texels = {height}};
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16}) {
    const double chosen = quantise_heights(field, type).texels[0];
    const double error = std::abs(chosen - height);
    for (std::uint32_t code = 0; code <= code_of_one(type); code += type == TexelType::unorm8 ? 1 : 251)
      RC_ASSERT(error <= std::abs(double{value(code, type)} - height) * (1 + 1e-6) + 1e-8);
  }
  RC_ASSERT(std::bit_cast<std::uint32_t>(quantise_heights(field, TexelType::float32).texels[0]) ==
            std::bit_cast<std::uint32_t>(height));
}

TEST(QuantiseHeights, HalvesTieToEven) {
  // Between 1024 and 2048 units of 2^-11 halves step by one unit: 1024.5 ties down, 1025.5 up.
  const Heightfield ties{.width = 2, .height = 1, .texels = {1024.5F * 0x1p-11F, 1025.5F * 0x1p-11F}};
  EXPECT_THAT(quantise_heights(ties, TexelType::float16).texels,
              ::testing::ElementsAre(1024.0F * 0x1p-11F, 1026.0F * 0x1p-11F));
}

RC_GTEST_PROP(Texture, UnpackGivesBackWhatWasPacked, ()) {
  const int width = *rc::gen::inRange(2, 12);
  const int height = *rc::gen::inRange(2, 12);
  const auto count = static_cast<std::size_t>(width * height);
  const Heightfield raw{
      .width = width, .height = height, .texels = *rc::gen::container<std::vector<float>>(count, any_ratio())};
  const auto ratios = *rc::gen::container<std::vector<float>>(count, any_ratio());
  for (const Format& format : formats()) {
    for (const Encoding& encoding : encodings()) {
      const Heightfield heights = quantise_heights(raw, format.type);
      const TextureImage image = pack_texture(heights, ratios, format, encoding);
      RC_ASSERT(image.texels.size() == count * static_cast<std::size_t>(format.bytes_per_texel()));
      const UnpackedTexture unpacked = unpack_texture(image, encoding);
      RC_ASSERT(unpacked.heights.width == width);
      RC_ASSERT(unpacked.heights.height == height);
      RC_ASSERT(unpacked.heights.texels == heights.texels);
      RC_ASSERT(unpacked.ratios.size() == (format.channels == 2 ? count : 0));
      for (std::size_t i = 0; i < unpacked.ratios.size(); ++i)
        RC_ASSERT(unpacked.ratios[i] == floor_ratio(ratios[i], format.type, encoding));
    }
  }
}

TEST(Texture, LayoutIsHeightThenRatioInHostOrder) {
  const Heightfield heights{.width = 2, .height = 1, .texels = {1.0F, 0.0F}};
  const TextureImage image =
      pack_texture(heights, std::vector{0.5F, 1.0F}, find_format("rg16"), find_encoding("ratio"));
  const auto b = [](int x) { return static_cast<std::byte>(x); };
  EXPECT_THAT(image.texels, ::testing::ElementsAre(b(0xff), b(0xff), b(0xff), b(0x7f), b(0), b(0), b(0xfe), b(0xff)));
}

TEST(Texture, RatioChannelIsZeroWithoutRatios) {
  const Heightfield heights{.width = 2, .height = 2, .texels = std::vector<float>(4, 1.0F)};
  const TextureImage image = pack_texture(heights, {}, find_format("rg8"), find_encoding("sqrt"));
  EXPECT_THAT(unpack_texture(image, find_encoding("sqrt")).ratios, ::testing::Each(0.0F));
}

TEST(Format, HasTheBytesOfItsName) {
  EXPECT_EQ(find_format("r8").bytes_per_texel(), 1);
  EXPECT_EQ(find_format("rg16").bytes_per_texel(), 4);
  EXPECT_EQ(find_format("rg16f").bytes_per_texel(), 4);
  EXPECT_EQ(find_format("rg32f").bytes_per_texel(), 8);
}

TEST(Format, UnknownIdsListTheChoices) {
  const auto message = [](const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([] { (void)find_format("rgba8"); }),
            "unknown texture format 'rgba8'; the choices are r8, r16, r16f, r32f, rg8, rg16, rg16f, rg32f");
  EXPECT_EQ(message([] { (void)find_encoding("log"); }), "unknown cone encoding 'log'; the choices are ratio, sqrt");
}

}  // namespace
}  // namespace reliefbench
