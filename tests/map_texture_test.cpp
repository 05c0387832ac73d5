#include "kernels/maps/map_texture.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace reliefbench {
namespace {

std::size_t count_of(int count) { return static_cast<std::size_t>(count); }
std::byte b(int x) { return static_cast<std::byte>(x); }

rc::Gen<float> any_value() {
  return rc::gen::map(rc::gen::inRange(0, (1 << 24) + 1), [](int i) { return static_cast<float>(i) * 0x1p-24F; });
}

RC_GTEST_PROP(MapTexture, UnpackGivesBackWhatWasPacked, ()) {
  const int width = *rc::gen::inRange(2, 12);
  const int height = *rc::gen::inRange(2, 12);
  const auto count = static_cast<std::size_t>(width * height);
  const Heightfield raw{
      .width = width, .height = height, .texels = *rc::gen::container<std::vector<float>>(count, any_value())};
  const auto ratios = *rc::gen::container<std::vector<float>>(count, any_value());
  for (const Format& format : formats()) {
    for (const Encoding& encoding : encodings()) {
      if (format.type == TexelType::bc7 && encoding.is_decreasing) continue;
      const Heightfield heights = quantise_heights(raw, format.type);
      const bool has_ratio = format.ratios() > 0;
      const MapSource source{.map = find_map(has_ratio ? MapKind::conservative : MapKind::height),
                             .heights = heights,
                             .values = has_ratio ? std::span<const float>(ratios) : std::span<const float>()};
      const MapTextures textures = pack_map(source, format, encoding);
      const bool has_blocks = is_of_blocks(format.type);
      const std::size_t texels = has_blocks ? 16 * ((count_of(width) + 3) / 4) * ((count_of(height) + 3) / 4) : count;
      RC_ASSERT(textures.bytes() * 8 == texels * count_of(format.bits_per_texel()));
      const UnpackedMap unpacked = unpack_map(textures, format, encoding);
      const auto channels = static_cast<std::size_t>(format.ratios());
      RC_ASSERT(unpacked.heights.width == width);
      RC_ASSERT(unpacked.heights.height == height);
      RC_ASSERT(unpacked.heights.texels == heights.texels);
      RC_ASSERT(unpacked.ratios.size() == channels * count);
      for (std::size_t i = 0; has_ratio && i < count; ++i) {
        const float floored = floor_ratio(ratios[i], heights.texels[i], format.type, encoding);
        const float ratio = unpacked.ratios[channels * i];
        RC_ASSERT((has_blocks ? std::min(ratio, floored) : floored) == ratio);
      }
    }
  }
}

TEST(MapTexture, LayoutIsHeightThenRatioInHostOrder) {
  const Heightfield heights{.width = 2, .height = 1, .texels = {1.0F, 0.0F}};
  const std::vector<float> ratios{0.5F, 1.0F};
  const MapSource source{.map = find_map(MapKind::conservative), .heights = heights, .values = ratios};
  EXPECT_THAT(pack_map(source, find_format("rg16"), find_encoding("ratio")).relief.texels,
              ::testing::ElementsAre(b(0xff), b(0xff), b(0xff), b(0x7f), b(0), b(0), b(0xfe), b(0xff)));
  const MapTextures split = pack_map(source, find_format("r8+r8"), find_encoding("ratio"));
  EXPECT_THAT(split.relief.texels, ::testing::ElementsAre(b(255), b(0)));
  EXPECT_THAT(split.extra.value().texels, ::testing::ElementsAre(b(127), b(254)));
}

TEST(MapTexture, RatioChannelsAreClosedWithoutRatios) {
  const Heightfield heights{.width = 2, .height = 2, .texels = std::vector<float>(4, 0.5F)};
  const MapSource source{.map = find_map(MapKind::height), .heights = heights, .values = {}};
  const MapTextures textures = pack_map(source, find_format("rg8"), find_encoding("sqrt"));
  EXPECT_THAT(unpack_map(textures, find_format("rg8"), find_encoding("sqrt")).ratios, ::testing::Each(0.0F));
}

// Up is up: a plane's normal is (0, 0, 1), stored as 1/2.
TEST(MapTexture, NormalsFollowTheRatio) {
  const Heightfield heights{.width = 2, .height = 2, .texels = std::vector<float>(4, 0.5F)};
  const std::vector<float> ratios(4, 1.0F);
  const MapSource source{.map = find_map(MapKind::conservative), .heights = heights, .values = ratios};
  const MapTextures textures = pack_map(source, find_format("rgba8"), find_encoding("ratio"));
  EXPECT_THAT(read_channel(textures.relief, 2), ::testing::Each(::testing::FloatNear(0.5F, 0.003F)));
  EXPECT_THAT(read_channel(textures.relief, 3), ::testing::Each(::testing::FloatNear(0.5F, 0.003F)));
}

}  // namespace
}  // namespace reliefbench
