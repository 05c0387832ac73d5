#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "kernels/base/sha256.h"
#include "kernels/image/heightmap.h"

namespace reliefbench {
namespace {

Heightfield make(std::string_view id, int width, int height, std::uint32_t seed = 1) {
  for (const ProceduralRow& row : procedurals())
    if (row.id == id) return row.generate(width, height, seed);
  ADD_FAILURE() << "no procedural map " << id;
  return {};
}

std::string heights_digest(const Heightfield& field) {
  const std::string tops = sha256(std::as_bytes(std::span(field.texels)));
  return field.is_solid() ? sha256(tops + sha256(std::as_bytes(std::span(field.floors)))).substr(0, 16)
                          : tops.substr(0, 16);
}

TEST(Procedural, HasRangeAndSizeAtEverySize) {
  for (const ProceduralRow& row : procedurals()) {
    for (const auto& [width, height] : {std::pair{2, 2}, {2, 9}, {9, 2}, {3, 3}, {17, 31}, {64, 64}, {100, 60}}) {
      const Heightfield field = row.generate(width, height, 7);
      EXPECT_EQ(field.width, width);
      EXPECT_EQ(field.height, height);
      ASSERT_EQ(field.texels.size(), static_cast<std::size_t>(width * height));
      ASSERT_EQ(field.floors.size(), row.is_solid ? field.texels.size() : 0);
      for (const std::vector<float>* heights : {&field.texels, &field.floors})
        EXPECT_TRUE(std::ranges::all_of(*heights, [](float h) { return h >= 0 && h <= 1; }))
            << row.id << " " << width << "x" << height;
    }
  }
}

// The same bits on every machine: results of different machines compare only then.
TEST(Procedural, BitsArePinned) {
  const std::map<std::string_view, std::string> expected{
      {"fbm", "1bfe928f3c3c0b58"},      {"ridged", "a2431bc45c3af4fb"},   {"bricks", "5a108ec34f946f61"},
      {"spikes", "41ca8088000825f5"},   {"posts", "fe1900683f24c9ed"},    {"checker", "9844a91220676d48"},
      {"cliff", "d2fc392ecf3a1b8b"},    {"pyramids", "6adc202b20630a72"}, {"plateau", "56f48eef642cb1c7"},
      {"constant", "c419e641fef3766a"}, {"ball", "d18f2d31e32e5118"},     {"half_torus", "37638badb4ef563d"},
      {"goblet", "d2ba011cbb623cc3"},   {"grille", "e929e1ff8945a1da"},   {"specks", "9cbbc8cdbe9d7410"},
      {"nothing", "fb63ebde3b103a01"},
  };
  ASSERT_EQ(expected.size(), procedurals().size());
  for (const ProceduralRow& row : procedurals())
    EXPECT_EQ(heights_digest(row.generate(48, 40, 3)), expected.at(row.id)) << row.id;
}

TEST(Procedural, SeedChangesTheRandomOnesOnly) {
  for (const ProceduralRow& row : procedurals()) {
    const bool random = row.id == "fbm" || row.id == "ridged" || row.id == "bricks" || row.id == "spikes" ||
                        row.id == "specks" || row.id == "nothing";
    EXPECT_EQ(heights_digest(row.generate(64, 64, 1)) != heights_digest(row.generate(64, 64, 2)), random) << row.id;
    EXPECT_EQ(heights_digest(row.generate(64, 64, 1)), heights_digest(row.generate(64, 64, 1))) << row.id;
  }
}

// No step between the last and the first column that is larger than the steps inside.
TEST(Procedural, IsSeamlessUnderRepeat) {
  for (const std::string_view id : {"fbm", "ridged", "bricks", "pyramids", "plateau", "constant"}) {
    const Heightfield field = make(id, 128, 128);
    float inside = 0;
    float seam = 0;
    for (int i = 0; i < 128; ++i) {
      for (int j = 1; j < 128; ++j) {
        inside = std::max(
            {inside, std::abs(field.at(j, i) - field.at(j - 1, i)), std::abs(field.at(i, j) - field.at(i, j - 1))});
      }
      seam = std::max({seam, std::abs(field.at(0, i) - field.at(127, i)), std::abs(field.at(i, 0) - field.at(i, 127))});
    }
    EXPECT_LE(seam, inside) << id;
  }
}

TEST(Procedural, NoiseUsesTheFullRange) {
  for (const std::string_view id : {"fbm", "ridged"}) {
    const Heightfield field = make(id, 128, 96, 5);
    const auto [low, high] = std::minmax_element(field.texels.begin(), field.texels.end());
    EXPECT_EQ(*low, 0.0F) << id;
    EXPECT_EQ(*high, 1.0F) << id;
  }
}

TEST(Procedural, ShapesAreWhatTheySay) {
  EXPECT_THAT(make("checker", 3, 2).texels, ::testing::ElementsAre(0, 1, 0, 1, 0, 1));
  EXPECT_THAT(make("cliff", 4, 2).texels, ::testing::ElementsAre(0, 0, 1, 1, 0, 0, 1, 1));
  EXPECT_THAT(make("constant", 2, 2).texels, ::testing::Each(0.5F));
  // Spacing 1/16 tile: a pyramid is four texels wide, its faces rise 1/2 a texel and stop 1/4 under the top.
  const Heightfield pyramids = make("pyramids", 16, 16);
  EXPECT_THAT(std::vector(pyramids.texels.begin() + 16, pyramids.texels.begin() + 20),
              ::testing::ElementsAre(0.25F, 0.75F, 0.75F, 0.25F));
  const Heightfield plateau = make("plateau", 64, 64);
  EXPECT_EQ(plateau.at(32, 32), 1.0F);
  EXPECT_EQ(std::count(plateau.texels.begin(), plateau.texels.end(), 1.0F), 32 * 32);
  EXPECT_EQ(plateau.at(0, 32), 0.0F);
  const Heightfield spikes = make("spikes", 64, 40);
  EXPECT_EQ(std::count_if(spikes.texels.begin(), spikes.texels.end(), [](float h) { return h > 0; }), 4 * 3);
  const Heightfield bricks = make("bricks", 256, 256);
  EXPECT_LE(bricks.at(0, 0), 0.1F);    // a joint
  EXPECT_GE(bricks.at(32, 16), 0.7F);  // the middle of the first brick
  EXPECT_LE(bricks.at(32, 48), 0.1F);  // half a brick further in the next row
}

}  // namespace
}  // namespace reliefbench
