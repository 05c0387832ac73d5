// Written out, as the small libraries that know TGA take a truncated file for a whole one with black texels.
#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"

namespace reliefbench {
namespace {

constexpr std::size_t kHeaderBytes = 18;
constexpr std::size_t kLongestRun = 128;  // texels in a packet

enum class Content { indices = 1, colours = 2, greys = 3 };

struct TgaHeader {
  Content content = Content::colours;
  bool is_packed = false;  ///< run-length packets
  int width = 0;
  int height = 0;
  int bits = 0;  ///< of a stored texel
  int alpha_bits = 0;
  bool is_top_down = false;
  bool is_right_to_left = false;
  bool has_palette = false;
  int palette_first = 0;
  int palette_size = 0;
  int palette_bits = 0;
  std::size_t id_bytes = 0;  ///< of the text between header and palette
};

/// Texels of 15 bits lie in two bytes.
std::size_t bytes_of(int bits) { return static_cast<std::size_t>(bits + 1) / 8; }

TgaHeader read_header(FileBytes bytes, const std::string& name) {
  if (bytes.size() < kHeaderBytes) fail_input("{}: the TGA is truncated", name);
  const auto word = [&](std::size_t at) { return bytes[at] | bytes[at + 1] << 8; };
  const int type = bytes[2];
  TgaHeader header{.content = static_cast<Content>(type & 7),
                   .is_packed = (type & 8) != 0,
                   .width = word(12),
                   .height = word(14),
                   .bits = bytes[16],
                   .alpha_bits = bytes[17] & 15,
                   .is_top_down = (bytes[17] & 0x20) != 0,
                   .is_right_to_left = (bytes[17] & 0x10) != 0,
                   .has_palette = bytes[1] == 1,
                   .palette_first = word(3),
                   .palette_size = word(5),
                   .palette_bits = bytes[7],
                   .id_bytes = bytes[0]};
  const auto is_one_of = [](int value, std::initializer_list<int> choices) {
    return std::ranges::count(choices, value) > 0;
  };
  const bool is_known = is_one_of(type, {1, 2, 3, 9, 10, 11}) && bytes[1] <= 1;
  const bool has_depth =
      header.content == Content::colours ? is_one_of(header.bits, {15, 16, 24, 32}) : is_one_of(header.bits, {8, 16});
  const bool has_colours =
      header.content != Content::indices || (header.has_palette && is_one_of(header.palette_bits, {15, 16, 24, 32}));
  if (!is_known || !has_depth || !has_colours)
    fail_input("{}: not a readable image: no TGA header of grey, colour or palette texels", name);
  return header;
}

using Texel = std::array<std::uint8_t, 4>;

/// A stored colour, blue first: 5 bits a channel, 8, or 8 with alpha.
Texel colour(FileBytes stored) {
  if (stored.size() > 2) return {stored[2], stored[1], stored[0], stored.size() > 3 ? stored[3] : std::uint8_t{255}};
  const int word = stored[0] | stored[1] << 8;
  const auto widened = [&](int shift) {
    const int five = word >> shift & 31;
    return static_cast<std::uint8_t>(five << 3 | five >> 2);
  };
  return {widened(10), widened(5), widened(0), 255};
}

/// Hands out the stored texels one by one, out of packets if they lie in such.
class TexelReader {
 public:
  TexelReader(FileBytes rest, std::size_t texel_bytes, bool is_packed)
      : rest_(rest), texel_bytes_(texel_bytes), is_packed_(is_packed) {}

  /// Whether the file can hold so many.
  [[nodiscard]] bool can_hold(std::size_t texels) const {
    return is_packed_ ? texels <= rest_.size() / (1 + texel_bytes_) * kLongestRun
                      : texels <= rest_.size() / texel_bytes_;
  }
  /// Empty where the file ends too early.
  [[nodiscard]] FileBytes next() {
    if (left_in_packet_ == 0) {
      if (is_packed_ && rest_.empty()) return {};
      const int packet = is_packed_ ? rest_[0] : 0;
      if (is_packed_) rest_ = rest_.subspan(1);
      left_in_packet_ = static_cast<std::size_t>(packet & 127) + 1;
      is_run_ = (packet & 128) != 0;
    }
    if (rest_.size() < texel_bytes_) return {};
    const FileBytes texel = rest_.first(texel_bytes_);
    --left_in_packet_;
    if (!is_run_ || left_in_packet_ == 0) rest_ = rest_.subspan(texel_bytes_);
    return texel;
  }

 private:
  FileBytes rest_;
  std::size_t texel_bytes_;
  bool is_packed_;
  bool is_run_ = false;
  std::size_t left_in_packet_ = 0;
};

std::vector<Texel> read_palette(const TgaHeader& header, FileBytes stored) {
  const std::size_t entry_bytes = bytes_of(header.palette_bits);
  std::vector<Texel> palette(static_cast<std::size_t>(header.palette_size));
  for (std::size_t i = 0; i < palette.size(); ++i) palette[i] = colour(stored.subspan(i * entry_bytes, entry_bytes));
  return palette;
}

}  // namespace

Image decode_tga(FileBytes bytes, const std::string& name) {
  const TgaHeader header = read_header(bytes, name);
  const bool is_grey = header.content == Content::greys;
  if (is_grey && header.bits == 16 && header.alpha_bits == 0)
    fail_input("{}: a grey TGA of 16 bits without alpha: expected 8 bits, or 8 and 8 of alpha", name);
  const bool has_alpha = header.bits == (is_grey ? 16 : 32);
  const int channels = (is_grey ? 1 : 3) + (has_alpha ? 1 : 0);
  check_shape(header.width, header.height, channels, name);

  const std::size_t palette_bytes =
      header.has_palette ? static_cast<std::size_t>(header.palette_size) * bytes_of(header.palette_bits) : 0;
  const std::size_t texels_at = kHeaderBytes + header.id_bytes + palette_bytes;
  if (bytes.size() < texels_at) fail_input("{}: the TGA is truncated", name);
  std::vector<Texel> palette;
  if (header.content == Content::indices) palette = read_palette(header, bytes.subspan(texels_at - palette_bytes));
  TexelReader stored(bytes.subspan(texels_at), bytes_of(header.bits), header.is_packed);
  const auto width = static_cast<std::size_t>(header.width);
  const auto height = static_cast<std::size_t>(header.height);
  if (!stored.can_hold(width * height)) fail_input("{}: the TGA is truncated", name);

  const auto texel_of = [&](FileBytes texel) -> Texel {
    if (is_grey) return {texel[0], texel.back()};
    if (header.content != Content::indices) return colour(texel);  // a palette may have no entry
    const int index = (texel[0] | (texel.size() > 1 ? texel[1] << 8 : 0)) - header.palette_first;
    if (index < 0 || index >= header.palette_size) fail_input("{}: a texel has no colour in the TGA's palette", name);
    return palette[static_cast<std::size_t>(index)];
  };
  Image image = blank_image(header.width, header.height, channels, has_alpha ? channels - 1 : -1, "8-bit");
  image.pixels.resize(width * height * static_cast<std::size_t>(channels));
  for (std::size_t i = 0; i < width * height; ++i) {
    const FileBytes next = stored.next();
    if (next.empty()) fail_input("{}: the TGA is truncated", name);
    const Texel texel = texel_of(next);
    const std::size_t y = header.is_top_down ? i / width : height - 1 - i / width;
    const std::size_t x = header.is_right_to_left ? width - 1 - i % width : i % width;
    for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c)
      image.pixels[(y * width + x) * static_cast<std::size_t>(channels) + c] = static_cast<float>(texel.at(c)) / 255.0F;
  }
  return image;
}

std::string encode_tga(const ImageSource& source) {
  const std::size_t channels = source.channels.size();
  assert(source.type == TexelType::unorm8 && channels != 2);
  std::string bytes(kHeaderBytes, '\0');
  const auto put = [&](std::size_t at, int value) { bytes[at] = static_cast<char>(value & 255); };
  put(2, static_cast<int>(channels == 1 ? Content::greys : Content::colours));
  put(12, source.width);
  put(13, source.width >> 8);
  put(14, source.height);
  put(15, source.height >> 8);
  put(16, static_cast<int>(8 * channels));
  put(17, channels == 4 ? 0x28 : 0x20);  // rows from the top, and the bits of alpha
  for (std::size_t at = 0; at < source.pixels.size(); at += channels) {
    std::string texel(reinterpret_cast<const char*>(&source.pixels[at]), channels);
    if (channels > 1) std::swap(texel[0], texel[2]);  // blue first
    bytes += texel;
  }
  return bytes;
}

}  // namespace reliefbench
