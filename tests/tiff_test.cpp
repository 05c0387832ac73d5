// What a TIFF says of its samples: where its first row and column lie, which end is white, what is no colour.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "kernels/image/decode.h"
#include "kernels/image/image.h"

namespace reliefbench {
namespace {

// Tags of a TIFF, by their numbers.
enum TiffTag : std::uint16_t {
  kTiffWidth = 256,
  kTiffHeight = 257,
  kTiffBits = 258,
  kTiffCompression = 259,
  kTiffPhotometric = 262,
  kTiffOffset = 273,
  kTiffOrientation = 274,
  kTiffSamples = 277,
  kTiffStripBytes = 279,
  kTiffExtraSamples = 338,
  kTiffSampleFormat = 339,
};
using TiffTags = std::map<std::uint16_t, std::uint16_t>;

/// A TIFF of one strip without compression. tags: those that differ from 8-bit grey, black at 0
std::vector<std::uint8_t> tiff_of(const std::vector<std::uint8_t>& strip, const TiffTags& tags) {
  TiffTags all = tags;
  all.merge(TiffTags{{kTiffBits, 8}, {kTiffCompression, 1}, {kTiffPhotometric, 1}, {kTiffSamples, 1}});
  const auto count = static_cast<std::uint16_t>(all.size() + 2);
  all[kTiffOffset] = static_cast<std::uint16_t>(8 + 2 + 12 * count + 4);
  all[kTiffStripBytes] = static_cast<std::uint16_t>(strip.size());
  std::vector<std::uint8_t> bytes;
  const auto put = [&](std::uint32_t value, int length) {
    for (int i = 0; i < length; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  put(0x2A4949, 4);  // II, 42
  put(8, 4);
  put(count, 2);
  for (const auto& [tag, value] : all) {
    put(tag, 2);
    put(3, 2);  // of 16 bits
    put(1, 4);
    put(value, 4);
  }
  put(0, 4);
  for (const std::uint8_t code : strip) put(code, 1);
  return bytes;
}

std::vector<int> codes_of(const Image& image, float most) {
  std::vector<int> codes;
  for (const float value : image.pixels) codes.push_back(static_cast<int>(std::lround(value * most)));
  return codes;
}

// 3 x 2 texels, stored as 1 2 3 / 4 5 6.
TEST(Tiff, lies_as_its_orientation_says_whatever_its_bits) {
  const std::vector<std::pair<int, std::vector<int>>> turned = {
      {1, {1, 2, 3, 4, 5, 6}}, {2, {3, 2, 1, 6, 5, 4}}, {3, {6, 5, 4, 3, 2, 1}}, {4, {4, 5, 6, 1, 2, 3}},
      {5, {1, 4, 2, 5, 3, 6}}, {6, {4, 1, 5, 2, 6, 3}}, {7, {6, 3, 5, 2, 4, 1}}, {8, {3, 6, 2, 5, 1, 4}}};
  for (const auto& [orientation, codes] : turned) {
    const TiffTags tags{{kTiffWidth, 3}, {kTiffHeight, 2}, {kTiffOrientation, static_cast<std::uint16_t>(orientation)}};
    TiffTags few = tags;
    few[kTiffBits] = 4;
    const Image of_8 = decode_tiff(tiff_of({1, 2, 3, 4, 5, 6}, tags), "8.tif");
    const Image of_4 = decode_tiff(tiff_of({0x12, 0x30, 0x45, 0x60}, few), "4.tif");
    EXPECT_EQ(codes_of(of_8, 255), codes) << orientation;
    EXPECT_EQ(codes_of(of_4, 15), codes) << orientation;
    EXPECT_EQ(of_8.width, orientation > 4 ? 2 : 3);
    EXPECT_EQ(of_4.width, of_8.width);
  }
}

TEST(Tiff, white_at_0_turns_what_is_seen_and_no_alpha) {
  const Image image = decode_tiff(
      tiff_of({10, 255, 20, 200, 30, 0, 40, 1},
              {{kTiffWidth, 2}, {kTiffHeight, 2}, {kTiffPhotometric, 0}, {kTiffSamples, 2}, {kTiffExtraSamples, 2}}),
      "grey.tif");
  EXPECT_EQ(image.alpha, 1);
  EXPECT_EQ(codes_of(image, 255), (std::vector{245, 255, 235, 200, 225, 0, 215, 1}));
}

TEST(Tiff, white_at_0_turns_signed_samples_too) {
  const Image image = decode_tiff(
      tiff_of({0, 127, 64, 1}, {{kTiffWidth, 2}, {kTiffHeight, 2}, {kTiffPhotometric, 0}, {kTiffSampleFormat, 2}}),
      "signed.tif");
  EXPECT_EQ(codes_of(image, 127), (std::vector{127, 0, 63, 126}));
}

}  // namespace
}  // namespace reliefbench
