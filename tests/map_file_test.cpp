#include "kernels/maps/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kernels/image/image.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/cone_map.h"
#include "tests/cone_test_maps.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

MapStorage storage_of(std::string_view format, std::string_view encoding = "sqrt") {
  return {.map = find_map(MapKind::conservative), .format = find_format(format), .encoding = find_encoding(encoding)};
}

MapTextures textures_of(const MapStorage& storage) {
  const Heightfield heights = quantise_heights(noise_map(9, 6), storage.format.type);
  const std::vector<float> ratios = bake_conservative({.heights = heights});
  return pack_map({.map = storage.map, .heights = heights, .values = ratios}, storage.format, storage.encoding);
}

TEST(MapFile, Ktx2HoldsEveryTextureAsItIs) {
  const TempFolder folder;
  for (const std::string_view format : {"rg8", "rg16", "rg16f", "rg32f", "rgba8", "r8+r8"}) {
    const MapStorage storage = storage_of(format);
    const MapTextures textures = textures_of(storage);
    const auto files = write_map(folder / "map.ktx2", storage, textures, {{"reliefbench.kind", "conservative"}});
    ASSERT_EQ(files.size(), textures.extra ? 2U : 1U);
    EXPECT_EQ(files[0], folder / "map.ktx2");
    EXPECT_EQ(read_ktx2(files[0]).image.texels, textures.relief.texels);
    EXPECT_EQ(read_ktx2(files[0]).metadata.at("reliefbench.kind"), "conservative");
    if (!textures.extra) continue;
    EXPECT_EQ(files[1], folder / "map.extra.ktx2");
    EXPECT_EQ(read_ktx2(files[1]).image.texels, textures.extra->texels);
  }
}

TEST(MapFile, PngHoldsTheCodes) {
  const TempFolder folder;
  for (const std::string_view format : {"rg8", "rg16", "rgba8", "r8+r8"}) {
    const MapStorage storage = storage_of(format);
    const MapTextures textures = textures_of(storage);
    const auto files = write_map(folder / "map.png", storage, textures, {});
    for (std::size_t i = 0; i < files.size(); ++i) {
      const TextureImage& texture = i == 0 ? textures.relief : *textures.extra;
      const Image image = load_image(files[i]);
      ASSERT_EQ(static_cast<int>(image.channels.size()), texture.layout.channels) << format;
      for (int channel = 0; channel < texture.layout.channels; ++channel) {
        const std::vector<float> values = read_channel(texture, channel);
        for (std::size_t texel = 0; texel < values.size(); ++texel)
          ASSERT_EQ(image.pixels[texel * image.channels.size() + static_cast<std::size_t>(channel)], values[texel])
              << format << " channel " << channel;
      }
    }
  }
}

TEST(MapFile, ExrHoldsHeightsAndRatios) {
  const TempFolder folder;
  for (const std::string_view format : {"rg8", "rg16f", "r8+r8"}) {
    const MapStorage storage = storage_of(format);
    const MapTextures textures = textures_of(storage);
    const UnpackedMap map = unpack_map(textures, storage.format, storage.encoding);
    ASSERT_THAT(write_map(folder / "map.exr", storage, textures, {}), ElementsAre(folder / "map.exr"));
    const Image image = load_image(folder / "map.exr");
    // EXR has its channels in alphabetical order.
    ASSERT_THAT(image.channels, ElementsAre("C", "H"));
    for (std::size_t i = 0; i < map.ratios.size(); ++i) {
      ASSERT_EQ(image.pixels[2 * i], map.ratios[i]);
      ASSERT_EQ(image.pixels[2 * i + 1], map.heights.texels[i]);
    }
  }
}

TEST(MapFile, SaysWhatAFileCannotHold) {
  EXPECT_EQ(file_conflict("map.ktx2", storage_of("rg16f")), "");
  EXPECT_EQ(file_conflict("map.png", storage_of("rg16")), "");
  EXPECT_EQ(file_conflict("map.exr", storage_of("rg32f")), "");
  EXPECT_THAT(file_conflict("map.png", storage_of("rg16f")), HasSubstr("cannot hold the floats of rg16f"));
  EXPECT_THAT(file_conflict("map.dds", storage_of("rg16")), HasSubstr(".ktx2, .exr or .png"));
  EXPECT_THAT(file_conflict("map", storage_of("rg16")), HasSubstr(".ktx2, .exr or .png"));
  MapRow pyramid = find_map(MapKind::height);
  pyramid.content = MapContent::pyramid;
  const MapStorage storage{.map = pyramid, .format = find_format("r16"), .encoding = find_encoding("ratio")};
  EXPECT_THAT(file_conflict("map.png", storage), HasSubstr(".ktx2 only"));
  EXPECT_EQ(file_conflict("map.ktx2", storage), "");
}

TEST(MapStorage, CertifiedConesAreNotForInterpolatedRadii) {
  MapStorage storage = storage_of("rg16", "h_tan");
  EXPECT_EQ(conflict(storage), "");
  storage.correction = Correction::certified;
  EXPECT_THAT(conflict(storage), HasSubstr("h_tan interpolates radii"));
}

}  // namespace
}  // namespace reliefbench
