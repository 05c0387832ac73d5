#include <cmath>
#include <random>

#include "kernels/maps/block_codec.h"
#include "tests/backend_rig.h"

namespace reliefbench {
namespace {

class TextureTest : public BackendTest {
 protected:
  /// Skips the test where none does.
  template <typename Body>
  static void on_devices_that_take(TexelType type, const Body& body) {
    int taking = 0;
    on_every_device([&](Rig& rig) {
      if (!rig.backend->device().takes(type)) return;
      ++taking;
      body(rig);
    });
    if (taking == 0) GTEST_SKIP() << "no device of " << row().id << " takes " << texel_type_id(type);
  }
};

/// Returns what a sampler gives at the pixel's own place: pixel x looks at u = (x + OFFSET/8) / 8, v likewise, so a
/// frame of 8x8 px walks over an 8-texel map and beyond. The first channel is t, the second is written as taps.
constexpr std::string_view kProbe = R"(
layout(constant_id = 20) const int OFFSET = 4;
layout(constant_id = 21) const int FETCH = 0;
Hit trace(Ray ray) {
  vec2 pixel = floor(gl_FragCoord.xy);
  vec2 value = FETCH != 0 ? texelFetch(relief_map, ivec2(pixel), 0).xy
                          : textureLod(relief_map, (pixel + float(OFFSET) / 8.0 - 4.0) / 8.0, 0.0).xy;
  return Hit(value.x, STATUS_HIT, int(round(value.y * 4096.0)), OFFSET);
}
)";

/// An 8x8 map whose texel (x, y) holds the code (x + 8 y) / 64 in its first channel and 1 - that in its second.
struct Map {
  std::vector<std::byte> texels;
  std::vector<float> first;   ///< as the shader should read them
  std::vector<float> second;  ///< 0 where there is one channel
};

std::uint16_t half_bits(float value) {
  // Multiples of 1/64 in [0,1] are exact in binary16.
  if (value == 0) return 0;
  const int exponent = std::ilogb(value);
  const float mantissa = std::ldexp(value, -exponent) - 1;
  return static_cast<std::uint16_t>(((exponent + 15) << 10) | static_cast<int>(std::lround(mantissa * 1024)));
}

template <typename T>
void append(std::vector<std::byte>& bytes, T value) {
  const auto* begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

float append_texel(std::vector<std::byte>& bytes, TexelType type, float value) {
  switch (type) {
    case TexelType::unorm8:
    case TexelType::rgtc:
    case TexelType::bc7:
      append(bytes, static_cast<std::uint8_t>(std::lround(value * 255)));
      break;
    case TexelType::eac:
      append(bytes, static_cast<std::uint16_t>(std::lround(value * 2047)));
      break;
    case TexelType::unorm16:
    case TexelType::astc:
      append(bytes, static_cast<std::uint16_t>(std::lround(value * 65535)));
      break;
    case TexelType::float16:
      append(bytes, half_bits(value));
      break;
    case TexelType::float32:
      append(bytes, value);
      break;
  }
  const float codes = type == TexelType::unorm8 ? 255.0F : 65535.0F;
  const bool is_float = type == TexelType::float16 || type == TexelType::float32;
  return is_float ? value : std::round(value * codes) / codes;
}

/// The same in blocks, as far as they can.
Map map_of_blocks(const TexelLayout& layout) {
  TextureImage codes{.width = 8, .height = 8, .layout = layout};
  for (int i = 0; i < 64; ++i)
    for (const int value : {i, 64 - i})
      if (value == i || layout.channels > 1) append_texel(codes.texels, layout.type, static_cast<float>(value) / 64);
  TextureImage blocks = as_blocks(codes, BlockRounding::nearest, BlockRounding::nearest);
  return {.texels = blocks.texels,
          .first = read_blocks(blocks, 0, 0),
          .second = layout.channels > 1 ? read_blocks(blocks, 1, 0) : std::vector<float>(64)};
}

Map map_of(const TexelLayout& format) {
  if (is_of_blocks(format.type)) return map_of_blocks(format);
  Map map;
  for (int i = 0; i < 64; ++i) {
    const float value = static_cast<float>(i) / 64;
    map.first.push_back(append_texel(map.texels, format.type, value));
    map.second.push_back(format.channels > 1 ? append_texel(map.texels, format.type, 1 - value) : 0.0F);
    for (int channel = 2; channel < format.channels; ++channel) append_texel(map.texels, format.type, 0.5F);
  }
  return map;
}

/// The probe's frame of `size` px square.
std::vector<ScorePixel> probe(const Rig& rig, const TextureDesc& desc, int offset, bool fetch, int size = 8) {
  const auto texture = rig.backend->upload(desc);
  const auto pipeline = rig.pipeline(
      compile_fragment({.name = "probe.glsl", .text = std::string(kProbe)}, Target::score, rig.row.dialect),
      Target::score, {{.id = 20, .value = offset}, {.id = 21, .value = fetch ? 1 : 0}});
  Scene scene{.view = {.id = "top", .elevation_deg = 90, .distance = 1.2, .fov_deg = 45}};
  scene.width_px = scene.height_px = size;
  rig.draw(*pipeline, scene, texture.get());
  return rig.backend->read_score();
}

// Blocks of all kinds: an eighth of them plain, others with and without ends, of any contrast.
// llvmpipe's division by multiplication makes a code less of some.
TEST_P(TextureTest, blocks_decode_as_they_do_here_or_to_a_code_less) {
  on_devices_that_take(TexelType::rgtc, [](Rig& rig) {
    constexpr int kSide = 64;
    std::mt19937 random(7);
    const auto below = [&](unsigned bound) { return static_cast<unsigned>(random() % bound); };
    TextureImage image{.width = kSide, .height = kSide, .layout = {.type = TexelType::rgtc, .channels = 2}};
    image.texels.resize(2 * std::size_t{kSide} * kSide);
    for (std::size_t block = 0; block < 256; ++block) {
      const unsigned contrast = 1U << block % 8U;
      const unsigned low = below(257 - contrast);
      for (std::size_t i = 0; i < 32; ++i) {
        const unsigned code = block % 3 == 0 && below(4) == 0 ? 255 * below(2) : low + below(contrast);
        const std::size_t texel = block / 16 * 4 * kSide + block % 16 * 4 + i / 8 * kSide + i / 2 % 4;
        image.texels[2 * texel + i % 2] = static_cast<std::byte>(code);
      }
    }
    const TextureImage blocks = as_blocks(image, BlockRounding::nearest, BlockRounding::below);
    const std::vector<ScorePixel> seen = probe(rig, texture_desc(blocks, Wrap::repeat), 4, true, kSide);
    const std::vector<float> first = read_blocks(blocks, 0, 0);
    const std::vector<float> second = read_blocks(blocks, 1, 0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_LE(seen[i].t, first[i] + 1.2e-7F) << i;
      EXPECT_GE(seen[i].t, first[i] - 1 / 255.0F - 1e-6F) << i;
      EXPECT_LE(seen[i].taps, std::round(second[i] * 4096)) << i;
      EXPECT_GE(seen[i].taps, std::round((second[i] - 1 / 255.0F) * 4096)) << i;
    }
  });
}

/// Blocks of any bits.
TextureImage random_blocks(int side, const TexelLayout& layout, unsigned seed) {
  std::mt19937 random(seed);
  TextureImage blocks{.width = side, .height = side, .layout = layout};
  blocks.texels.resize(image_bytes(blocks));
  for (std::byte& byte : blocks.texels) byte = static_cast<std::byte>(random() % 256);
  return blocks;
}

// Of other makers' blocks, whose quotients devices round as they like.
TEST_P(TextureTest, any_block_decodes_within_two_codes_of_here) {
  on_devices_that_take(TexelType::rgtc, [](Rig& rig) {
    constexpr int kSide = 64;
    const TextureImage blocks = random_blocks(kSide, {.type = TexelType::rgtc, .channels = 1}, 8);
    const std::vector<ScorePixel> seen = probe(rig, texture_desc(blocks, Wrap::repeat), 4, true, kSide);
    const std::vector<float> decoded = read_blocks(blocks, 0, 0);
    for (std::size_t i = 0; i < decoded.size(); ++i) EXPECT_NEAR(seen[i].t, decoded[i], 2 / 255.0 + 1e-6) << i;
  });
}

// Any bits are a block: of each code either the exact value or that of its bits, repeated to 16.
TEST_P(TextureTest, eac_decodes_to_the_codes_that_it_has_here) {
  on_devices_that_take(TexelType::eac, [](Rig& rig) {
    constexpr int kSide = 64;
    const TextureImage blocks = random_blocks(kSide, {.type = TexelType::eac, .channels = 2}, 9);
    const std::vector<ScorePixel> seen = probe(rig, texture_desc(blocks, Wrap::repeat), 4, true, kSide);
    const std::vector<float> first = read_blocks(blocks, 0, 0);
    const std::vector<float> second = read_blocks(blocks, 1, 0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      const auto code = static_cast<unsigned>(std::lround(first[i] * 2047));
      const float repeated = static_cast<float>(code << 5U | code >> 6U) / 65535;
      const float off = std::min(std::abs(seen[i].t - first[i]), std::abs(seen[i].t - repeated));
      EXPECT_LE(off, 1.2e-7F) << i;
      EXPECT_NEAR(seen[i].t, first[i], value_spread(TexelType::eac)) << i;
      EXPECT_NEAR(seen[i].taps, second[i] * 4096, 1) << i;
    }
  });
}

// Any bits of modes 4 to 6.
TEST_P(TextureTest, bc7_decodes_to_the_codes_that_it_has_here) {
  on_devices_that_take(TexelType::bc7, [](Rig& rig) {
    constexpr int kSide = 64;
    TextureImage blocks = random_blocks(kSide, {.type = TexelType::bc7, .channels = 2}, 10);
    for (std::size_t i = 0; i < blocks.texels.size(); i += 16) {
      const auto mode = static_cast<unsigned>(4 + i / 16 % 3);
      blocks.texels[i] = (blocks.texels[i] << (mode + 1U)) | std::byte{1} << mode;
    }
    const std::vector<ScorePixel> seen = probe(rig, texture_desc(blocks, Wrap::repeat), 4, true, kSide);
    const std::vector<float> first = read_blocks(blocks, 0, 0);
    const std::vector<float> second = read_blocks(blocks, 1, 0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_NEAR(seen[i].t, first[i], 1.2e-7F) << i;
      EXPECT_EQ(seen[i].taps, std::round(second[i] * 4096)) << i;
    }
  });
}

// Decoded to binary16, to 16 bits or to 8.
TEST_P(TextureTest, astc_decodes_to_about_the_codes_that_it_has_here) {
  on_devices_that_take(TexelType::astc, [](Rig& rig) {
    constexpr int kSide = 64;
    std::mt19937 random(11);
    TextureImage codes{.width = kSide, .height = kSide, .layout = {.type = TexelType::astc, .channels = 2}};
    for (std::size_t i = 0; i < 2 * std::size_t{kSide} * kSide; ++i)
      append(codes.texels, static_cast<std::uint16_t>(random() % (1U << (1 + i / 512 % 16))));
    const TextureImage blocks = as_blocks(codes, BlockRounding::nearest, BlockRounding::below);
    const std::vector<ScorePixel> seen = probe(rig, texture_desc(blocks, Wrap::repeat), 4, true, kSide);
    const std::vector<float> first = read_blocks(blocks, 0, 0);
    const std::vector<float> second = read_blocks(blocks, 1, 0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_NEAR(seen[i].t, first[i], 1 / 255.0 + 1e-6) << i;
      EXPECT_NEAR(seen[i].taps, second[i] * 4096, 4096 / 255.0 + 1) << i;
    }
  });
}

TEST_P(TextureTest, a_device_without_blocks_says_so) {
  on_every_device([](Rig& rig) {
    for (const TexelType type : {TexelType::rgtc, TexelType::eac, TexelType::bc7, TexelType::astc}) {
      if (rig.backend->device().takes(type)) continue;
      const Map map = map_of({.type = type, .channels = 1});
      EXPECT_THROW((void)rig.backend->upload(
                       {.width = 8, .height = 8, .layout = {.type = type, .channels = 1}, .texels = map.texels}),
                   Error);
    }
  });
}

TEST_P(TextureTest, every_format_is_read_back_as_uploaded) {
  on_every_device([](Rig& rig) {
    for (const Format& format : formats())
      for (const bool fetch : {true, false}) {
        if (!rig.backend->device().takes(format.type)) continue;
        const Map map = map_of(format.relief());
        const std::vector<ScorePixel> seen = probe(rig,
                                                   {.width = 8,
                                                    .height = 8,
                                                    .layout = format.relief(),
                                                    .texels = map.texels,
                                                    .filter = fetch ? Filter::linear : Filter::nearest},
                                                   4, fetch);
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 8; ++x) {
            // The probe's textureLod starts half a map early; repeat brings it back.
            const int shift = fetch ? 0 : 4;
            const auto at = static_cast<std::size_t>((x + shift) % 8 + 8 * ((y + shift) % 8));
            const ScorePixel& pixel = seen[static_cast<std::size_t>(x + 8 * y)];
            // Of BC4 and BC5, a device may cut off; of ASTC, it may leave 8 bits.
            const bool is_rough = format.type == TexelType::rgtc || format.type == TexelType::astc;
            const double off = is_rough ? 1 / 255.0 : static_cast<double>(value_spread(format.type));
            EXPECT_NEAR(pixel.t, map.first[at], off + 1e-6) << format.id << " at " << x << "," << y;
            EXPECT_NEAR(pixel.taps, map.second[at] * 4096, off * 4096 + 1) << format.id << " at " << x << "," << y;
          }
      }
  });
}

TEST_P(TextureTest, a_texture_without_format_is_rgba8) {
  on_every_device([](Rig& rig) {
    std::vector<std::byte> texels;
    for (int i = 0; i < 64; ++i)
      for (const int value : {4 * i, 255 - i, 7, 255}) texels.push_back(static_cast<std::byte>(value));
    const std::vector<ScorePixel> seen = probe(rig, {.width = 8, .height = 8, .texels = texels}, 4, true);
    for (int i = 0; i < 64; ++i) {
      EXPECT_NEAR(seen[static_cast<std::size_t>(i)].t, 4.0 * i / 255, 1e-6);
      EXPECT_NEAR(seen[static_cast<std::size_t>(i)].taps, (255.0 - i) / 255 * 4096, 1);
    }
  });
}

TEST_P(TextureTest, wrap_modes_and_filters_answer_for_every_place) {
  on_every_device([](Rig& rig) {
    const Map map = map_of(kFloat);
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
      for (const Filter filter : {Filter::nearest, Filter::linear})
        for (const int offset : {4, 6}) {  // at texel centres, and a quarter texel beyond
          // 16 px: 4 texels before the map, the map, 4 texels after it.
          const std::vector<ScorePixel> seen = probe(
              rig, {.width = 8, .height = 8, .layout = kFloat, .texels = map.texels, .wrap = wrap, .filter = filter},
              offset, false, 16);
          const float f = filter == Filter::linear && offset == 6 ? 0.25F : 0.0F;
          const auto texel = [&](int x, int y) {
            return map.first[static_cast<std::size_t>(wrapped(x, 8, wrap) + 8 * wrapped(y, 8, wrap))];
          };
          for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) {
              const int i = x - 4;
              const int j = y - 4;
              const float expected = (1 - f) * ((1 - f) * texel(i, j) + f * texel(i + 1, j)) +
                                     f * ((1 - f) * texel(i, j + 1) + f * texel(i + 1, j + 1));
              // Half a step of an 8-bit filter weight, over the map's whole range.
              EXPECT_NEAR(seen[static_cast<std::size_t>(x + 16 * y)].t, expected, f > 0 ? 1.0 / 256 : 1e-6)
                  << "wrap " << static_cast<int>(wrap) << " filter " << static_cast<int>(filter) << " at " << i << ","
                  << j;
            }
        }
  });
}

TEST_P(TextureTest, specialization_constants_reach_the_shader) {
  on_every_device([](Rig& rig) {
    const Map map = map_of(kFloat);
    const TextureDesc desc{.width = 8, .height = 8, .layout = kFloat, .texels = map.texels, .filter = Filter::nearest};
    EXPECT_EQ(probe(rig, desc, 4, false)[0].steps, 4);
    EXPECT_EQ(probe(rig, desc, -3, false)[0].steps, -3);
    EXPECT_NE(probe(rig, desc, 12, false)[0].t, probe(rig, desc, 4, false)[0].t);
  });
}

TEST_P(TextureTest, a_texture_of_the_wrong_size_is_refused) {
  on_every_device([](Rig& rig) {
    const std::vector<std::byte> texels(64);
    EXPECT_THROW((void)rig.backend->upload({.width = 9, .height = 8, .layout = kFloat, .texels = texels}), Error);
    EXPECT_THROW((void)rig.backend->upload({.width = 0, .height = 8, .layout = kFloat, .texels = {}}), Error);
  });
}

INSTANTIATE_TEST_SUITE_P(backends, TextureTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
