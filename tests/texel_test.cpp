#include "kernels/maps/texel.h"

#include <Imath/half.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr std::array kTypes{TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32};

/// All codes for values in [0, 1] are [0, code_of_one].
std::uint32_t code_of_one(TexelType type) {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::rgtc:
    case TexelType::bc7:
      return 255;
    case TexelType::eac:
      return 2047;
    case TexelType::unorm16:
    case TexelType::astc:
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
    case TexelType::rgtc:
    case TexelType::bc7:
      return static_cast<float>(code) / 255.0F;
    case TexelType::eac:
      return static_cast<float>(code) / 2047.0F;
    case TexelType::unorm16:
    case TexelType::astc:
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

bool is_guarded(float decoded, float ratio, const Encoding& encoding) { return decoded * encoding.guard < ratio; }

/// The next wider cone's code.
std::uint32_t wider(std::uint32_t code, const Encoding& encoding) {
  return encoding.is_decreasing ? code - 1 : code + 1;
}

/// The code of the narrowest cone.
std::uint32_t narrowest(TexelType type, const Encoding& encoding) {
  return encoding.is_decreasing ? code_of_one(type) : 0;
}

/// A ratio of any magnitude: log-uniform bits in [0, 1].
rc::Gen<float> any_ratio() {
  return rc::gen::map(rc::gen::inRange<std::uint32_t>(0, 0x3f800001),
                      [](std::uint32_t bits) { return std::bit_cast<float>(bits); });
}

RC_GTEST_PROP(FloorRatio, IsTheWidestStorableConeBelow, ()) {
  const float ratio = *rc::gen::oneOf(
      any_ratio(), rc::gen::map(rc::gen::inRange(0, 1 << 24), [](int i) { return static_cast<float>(i) * 0x1p-24F; }));
  const float height = *any_ratio();
  for (const TexelType type : kTypes) {
    for (const Encoding& encoding : encodings()) {
      const std::uint32_t code = floor_code(ratio, height, type, encoding);
      const float decoded = encoding.decode(value(code, type), height);
      RC_ASSERT(floor_ratio(ratio, height, type, encoding) == decoded);
      RC_ASSERT(code == narrowest(type, encoding) || is_guarded(decoded, ratio, encoding));
      if (decoded == 1.0F || wider(code, encoding) > code_of_one(type)) continue;
      RC_ASSERT(!is_guarded(encoding.decode(value(wider(code, encoding), type), height), ratio, encoding));
    }
  }
}

TEST(FloorRatio, HoldsAtAndAroundEveryUnormAndHalfCode) {
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16}) {
    for (const std::string_view id : {"ratio", "sqrt"}) {
      const Encoding& encoding = find_encoding(id);
      for (std::uint32_t code = 0; code <= code_of_one(type); ++code) {
        const float exact = encoding.decode(value(code, type), 0);
        const float below = code == 0 ? 0.0F : encoding.decode(value(code - 1, type), 0);
        // The guard takes the code itself; one ulp more than it, and it fits.
        ASSERT_EQ(floor_ratio(exact, 0, type, encoding), below) << encoding.id << code;
        if (exact < 1) {
          ASSERT_EQ(floor_ratio(std::nextafter(exact, 2.0F), 0, type, encoding), exact) << encoding.id << code;
        }
      }
    }
  }
}

TEST(FloorRatio, KeepsZero) {
  for (const TexelType type : kTypes)
    for (const Encoding& encoding : encodings()) EXPECT_EQ(floor_ratio(0.0F, 0.25F, type, encoding), 0.0F);
}

// The decode is what defines the encoding; it is to be the angle that it is named after.
TEST(Encoding, AnglesAreTheirTangents) {
  const Encoding& encoding = find_encoding("atan");
  for (int i = 1; i < 1000; ++i) {
    const double stored = i / 1000.0;
    const double exact = 1 / std::tan(stored * std::acos(-1.0) / 2);
    EXPECT_NEAR(encoding.decode(static_cast<float>(stored), 0), exact, 3e-4 * exact) << stored;
  }
  EXPECT_EQ(encoding.decode(1.0F, 0), 0.0F);
}

// Of ratio 1, where its halves meet, it once jumped by 4e-4: what is proved of the ratios of two codes was not true of
// a code between them.
TEST(Encoding, BetweenTwoAnglesNoConeIsWiderThanTheLine) {
  const Encoding& encoding = find_encoding("atan");
  for (const float step : {0x1p-16F, 0x1p-12F, 0x1p-8F})
    for (float stored = 0.25F; stored <= 0.75F; stored += 0x1p-9F + 0x1p-16F) {
      const float line = 0.5F * (encoding.decode(stored - step, 0) + encoding.decode(stored + step, 0));
      EXPECT_LE(encoding.decode(stored, 0), line * (1 + 0x1p-21F)) << stored << " " << step;
    }
  EXPECT_LE(encoding.decode(0.5F - 0x1p-16F, 0), 1.0001F);
}

TEST(Encoding, HTanIsTheRadiusAtTheTopPlate) {
  const Encoding& encoding = find_encoding("h_tan");
  EXPECT_EQ(encoding.decode(0.25F, 0.5F), 0.5F);
  EXPECT_EQ(encoding.decode(0.0F, 1.0F), 0.0F);
  EXPECT_TRUE(std::isfinite(encoding.decode(1.0F, 1.0F)));
}

// More than 1: floats hold it, and the radius or the angle do in any type.
TEST(FloorRatio, HoldsRatiosOverOne) {
  EXPECT_EQ(floor_ratio(100.0F, 0, TexelType::float16, find_encoding("ratio")),
            value(nearest_code(100, TexelType::float16) - 1, TexelType::float16));
  EXPECT_NEAR(floor_ratio(3.0F, 0.9F, TexelType::unorm16, find_encoding("h_tan")), 3, 1e-3);
  EXPECT_NEAR(floor_ratio(100.0F, 0, TexelType::unorm16, find_encoding("atan")), 100, 0.5);
}

TEST(FloorRatio, LosesOneCodeAtTheClamp) {
  EXPECT_EQ(floor_ratio(1.0F, 0, TexelType::unorm8, find_encoding("ratio")), 254.0F / 255.0F);
  EXPECT_EQ(floor_ratio(1.0F, 0, TexelType::float16, find_encoding("ratio")), 2047.0F / 2048.0F);
}

// The steepest cone of a 256 map is 1/(sqrt2 * 256): 8 bits hold nothing of it, their square root does.
TEST(FloorRatio, EightBitsStallWhereTheirSquareRootDoesNot) {
  const float steepest = 1 / (std::sqrt(2.0F) * 256);
  EXPECT_EQ(floor_ratio(steepest, 0, TexelType::unorm8, find_encoding("ratio")), 0.0F);
  EXPECT_EQ(floor_code(steepest, 0, TexelType::unorm8, find_encoding("ratio")), 0U);
  EXPECT_EQ(floor_code(steepest, 0, TexelType::unorm8, find_encoding("sqrt")), 13U);
  EXPECT_GT(floor_ratio(steepest, 0, TexelType::unorm8, find_encoding("sqrt")), 0.9F * steepest);
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

TEST(Format, HasTheBytesOfItsName) {
  EXPECT_EQ(find_format("r8").bits_per_texel(), 8);
  EXPECT_EQ(find_format("rg16").bits_per_texel(), 32);
  EXPECT_EQ(find_format("rg16f").bits_per_texel(), 32);
  EXPECT_EQ(find_format("rg32f").bits_per_texel(), 64);
  EXPECT_EQ(find_format("bc4").bits_per_texel(), 4);
  EXPECT_EQ(find_format("bc5").bits_per_texel(), 8);
  EXPECT_EQ(find_format("eac_r11").bits_per_texel(), 4);
  EXPECT_EQ(find_format("eac_rg11").bits_per_texel(), 8);
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
  EXPECT_EQ(message([] { (void)find_format("rgb8"); }),
            "texture format 'rgb8' is unknown (did you mean 'rg8'?; known: r8, r16, r16f, r32f, rg8, rg16, rg16f, "
            "rg32f, rgba8, "
            "r8+r8, r8+rgba8, "
            "r16+rgba16, r16f+rgba16f, r32f+rgba32f, bc4, bc5, eac_r11, eac_rg11, bc7, astc)");
  EXPECT_EQ(message([] { (void)find_encoding("log"); }),
            "cone encoding 'log' is unknown (known: ratio, sqrt, h_tan, atan)");
}

}  // namespace
}  // namespace reliefbench
