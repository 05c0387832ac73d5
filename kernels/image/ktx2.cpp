#include "kernels/image/ktx2.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <vector>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

static_assert(std::endian::native == std::endian::little);  // as the file is

constexpr std::array<unsigned char, 12> kIdentifier{0xAB, 'K', 'T', 'X', ' ', '2', '0', 0xBB, '\r', '\n', 0x1A, '\n'};

/// The file's fixed start, as it lies there.
struct Header {
  std::array<unsigned char, 12> identifier = kIdentifier;
  std::uint32_t vk_format = 0;
  std::uint32_t type_size = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t depth = 0;
  std::uint32_t layers = 0;
  std::uint32_t faces = 1;
  std::uint32_t levels = 0;
  std::uint32_t supercompression = 0;
  std::uint32_t descriptor_offset = 0;
  std::uint32_t descriptor_bytes = 0;
  std::uint32_t metadata_offset = 0;
  std::uint32_t metadata_bytes = 0;
  std::uint64_t supercompression_offset = 0;
  std::uint64_t supercompression_bytes = 0;
};
static_assert(sizeof(Header) == 80);

struct LevelIndex {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t uncompressed_bytes = 0;
};
static_assert(sizeof(LevelIndex) == 24);

/// VkFormat of a texel layout.
struct FormatRow {
  TexelLayout layout;
  std::uint32_t vk_format = 0;
};
constexpr std::array kKtx2Formats{
    FormatRow{{TexelType::unorm8, 1}, 9},    FormatRow{{TexelType::unorm8, 2}, 16},
    FormatRow{{TexelType::unorm8, 4}, 37},   FormatRow{{TexelType::unorm16, 1}, 70},
    FormatRow{{TexelType::unorm16, 2}, 77},  FormatRow{{TexelType::unorm16, 4}, 91},
    FormatRow{{TexelType::float16, 1}, 76},  FormatRow{{TexelType::float16, 2}, 83},
    FormatRow{{TexelType::float16, 4}, 97},  FormatRow{{TexelType::float32, 1}, 100},
    FormatRow{{TexelType::float32, 2}, 103}, FormatRow{{TexelType::float32, 4}, 109},
    FormatRow{{TexelType::rgtc, 1}, 139},    FormatRow{{TexelType::rgtc, 2}, 141},
    FormatRow{{TexelType::eac, 1}, 153},     FormatRow{{TexelType::eac, 2}, 155},
    FormatRow{{TexelType::bc7, 2}, 145},     FormatRow{{TexelType::astc, 2}, 157},
};

/// Of what bytes are swapped together on other machines.
std::uint32_t type_size(const TexelLayout& layout) {
  return is_of_blocks(layout.type) ? 1 : static_cast<std::uint32_t>(layout.bytes() / layout.channels);
}

template <typename Value>
void append(std::string& out, const Value& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(Value));
}

void pad(std::string& out, std::size_t alignment) {
  out.append((alignment - out.size() % alignment) % alignment, '\0');
}

/// Of what levels are made of: a texel or a block.
int unit_bytes(const TexelLayout& layout) { return static_cast<int>(level_bytes(layout, 1, 1)); }

/// Its color model: RGBSDA, BC4, BC5, ETC2, BC7 or ASTC.
std::uint8_t color_model(const TexelLayout& layout) {
  if (layout.type == TexelType::eac) return 161;
  if (layout.type == TexelType::bc7) return 134;
  if (layout.type == TexelType::astc) return 162;
  if (layout.type == TexelType::rgtc) return layout.channels == 1 ? 131 : 132;
  return 1;
}

/// The basic block of the Khronos Data Format Specification: no primaries (this is data), linear.
std::string descriptor(const TexelLayout& layout) {
  constexpr std::array<std::uint8_t, 4> kChannelIds{0, 1, 2, 15};  // red, green, blue, alpha
  constexpr std::uint8_t kSignedFloat = 0x80 | 0x40;
  const bool is_signed = is_float(layout.type);
  const bool has_blocks = is_of_blocks(layout.type);
  // A sample is a channel of a texel or of a block, or all of a block whose channels are one.
  const auto samples = static_cast<std::uint32_t>(has_one_block(layout.type) ? 1 : layout.channels);
  const std::uint32_t size = static_cast<std::uint32_t>(unit_bytes(layout)) / samples;
  const std::uint32_t block_bytes = 24 + 16 * samples;
  std::string out;
  append(out, std::uint32_t{4 + block_bytes});
  append(out, std::uint32_t{0});                         // Khronos, basic descriptor
  append(out, std::uint32_t{2 | (block_bytes << 16U)});  // version 1.3
  // Primaries unspecified, linear, straight alpha.
  append(out, std::array<std::uint8_t, 4>{color_model(layout), 0, 1, 0});
  append(out, std::uint32_t{has_blocks ? 0x0303U : 0U});  // blocks of 4 x 4 texels or of one
  append(out, std::array<std::uint8_t, 8>{static_cast<std::uint8_t>(samples * size)});
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    append(out, static_cast<std::uint16_t>(8 * size * sample));
    append(out, static_cast<std::uint8_t>(8 * size - 1));
    append(out, static_cast<std::uint8_t>(kChannelIds.at(sample) | (is_signed ? kSignedFloat : 0)));
    append(out, std::uint32_t{0});  // position in the block
    // Floats have their limits as floats of 32 bits, whatever their own size.
    append(out, is_signed ? std::bit_cast<std::uint32_t>(-1.0F) : 0U);
    append(out, is_signed ? std::bit_cast<std::uint32_t>(1.0F) : (has_blocks ? ~0U : (1U << (8 * size)) - 1));
  }
  return out;
}

std::string encoded_metadata(const std::map<std::string, std::string>& metadata) {
  std::string out;
  for (const auto& [key, value] : metadata) {
    append(out, static_cast<std::uint32_t>(key.size() + value.size() + 2));
    out.append(key).append(1, '\0').append(value).append(1, '\0');
    pad(out, 4);
  }
  return out;
}

std::size_t bytes_of_level(const TextureImage& image, int level) {
  return level_bytes(image.layout, level_side(image.width, level), level_side(image.height, level));
}

/// A checked view of the file's bytes.
class Reader {
 public:
  Reader(std::span<const std::byte> bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[nodiscard]] std::span<const std::byte> part(std::uint64_t offset, std::uint64_t count,
                                                std::string_view what) const {
    if (offset > bytes_.size() || count > bytes_.size() - offset)
      fail("{} lies at {} + {} bytes, the file has {}: it is cut short or broken", what, offset, count, bytes_.size());
    return bytes_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(count));
  }

  template <typename Value>
  [[nodiscard]] Value read(std::uint64_t offset, std::string_view what) const {
    Value value;
    std::memcpy(&value, part(offset, sizeof(Value), what).data(), sizeof(Value));
    return value;
  }

  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    fail_input("{}: {}", name_, fmt::format(text, std::forward<Args>(args)...));
  }

 private:
  std::span<const std::byte> bytes_;
  std::string_view name_;
};

TextureImage checked_image(const Reader& reader, const Header& header) {
  const auto* const row = std::find_if(kKtx2Formats.begin(), kKtx2Formats.end(),
                                       [&](const FormatRow& format) { return format.vk_format == header.vk_format; });
  if (row == kKtx2Formats.end()) reader.fail("VkFormat {} is none that maps are stored in", header.vk_format);
  const auto is_side = [](std::uint32_t side) { return side >= 1 && side <= 1U << 20U; };
  if (!is_side(header.width) || !is_side(header.height))
    reader.fail("{} x {} texels are not possible", header.width, header.height);
  if (header.depth != 0 || header.layers != 0 || header.faces != 1)
    reader.fail("is a volume, an array or a cube map; a single 2D texture was expected");
  if (header.supercompression != 0 || header.supercompression_bytes != 0)
    reader.fail("is supercompressed (scheme {}), which is not read", header.supercompression);
  const auto most = static_cast<std::uint32_t>(std::bit_width(std::max(header.width, header.height)));
  if (header.levels < 1 || header.levels > most) reader.fail("{} mip levels, expected 1 to {}", header.levels, most);
  if (header.type_size != type_size(row->layout))
    reader.fail("a type size of {}, expected {}", header.type_size, type_size(row->layout));
  return {.width = static_cast<int>(header.width),
          .height = static_cast<int>(header.height),
          .layout = row->layout,
          .levels = static_cast<int>(header.levels),
          .texels = {}};
}

std::map<std::string, std::string> decoded_metadata(const Reader& reader, const Header& header) {
  const auto bytes = reader.part(header.metadata_offset, header.metadata_bytes, "the metadata");
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::map<std::string, std::string> metadata;
  std::size_t at = 0;
  while (at < text.size()) {
    std::uint32_t size = 0;
    if (text.size() - at < sizeof(size)) reader.fail("the metadata ends within an entry");
    std::memcpy(&size, text.data() + at, sizeof(size));
    at += sizeof(size);
    if (size > text.size() - at) reader.fail("a metadata entry of {} bytes does not fit", size);
    const std::string_view entry = text.substr(at, size);
    const std::size_t end = entry.find('\0');
    if (end == std::string_view::npos || end == 0) reader.fail("a metadata entry without a key");
    std::string_view value = entry.substr(end + 1);
    if (!value.empty() && value.back() == '\0') value.remove_suffix(1);
    if (!metadata.emplace(entry.substr(0, end), value).second)
      reader.fail("the metadata has '{}' twice", entry.substr(0, end));
    at += std::min((std::size_t{size} + 3) / 4 * 4, text.size() - at);
  }
  return metadata;
}

}  // namespace

std::string encode_ktx2(const Ktx2File& file) {
  const TextureImage& image = file.image;
  const auto* const row = std::find_if(kKtx2Formats.begin(), kKtx2Formats.end(),
                                       [&](const FormatRow& format) { return format.layout == image.layout; });
  if (row == kKtx2Formats.end()) fail_input("KTX2: no format of {} channels", image.layout.channels);
  const auto levels = static_cast<std::size_t>(image.levels);
  const std::string format_block = descriptor(image.layout);
  std::map<std::string, std::string> entries = file.metadata;
  if (image.layout.type == TexelType::astc) entries["KTXswizzle"] = "ra01";
  const std::string metadata = encoded_metadata(entries);

  Header header{.vk_format = row->vk_format,
                .type_size = type_size(image.layout),
                .width = static_cast<std::uint32_t>(image.width),
                .height = static_cast<std::uint32_t>(image.height),
                .levels = static_cast<std::uint32_t>(image.levels)};
  header.descriptor_offset = static_cast<std::uint32_t>(sizeof(Header) + levels * sizeof(LevelIndex));
  header.descriptor_bytes = static_cast<std::uint32_t>(format_block.size());
  header.metadata_bytes = static_cast<std::uint32_t>(metadata.size());
  if (!metadata.empty()) header.metadata_offset = header.descriptor_offset + header.descriptor_bytes;

  std::string out(header.descriptor_offset, '\0');
  out += format_block;
  out += metadata;
  std::vector<LevelIndex> index(levels);
  std::size_t end = image.texels.size();
  for (std::size_t level = levels; level-- > 0;) {  // the smallest first
    const std::size_t bytes = bytes_of_level(image, static_cast<int>(level));
    end -= bytes;
    pad(out, static_cast<std::size_t>(std::lcm(unit_bytes(image.layout), 4)));
    index[level] = {.offset = out.size(), .bytes = bytes, .uncompressed_bytes = bytes};
    out.append(reinterpret_cast<const char*>(image.texels.data()) + end, bytes);
  }
  std::memcpy(out.data(), &header, sizeof(header));
  std::memcpy(out.data() + sizeof(header), index.data(), levels * sizeof(LevelIndex));
  return out;
}

Ktx2File decode_ktx2(std::span<const std::byte> bytes, std::string_view name) {
  const Reader reader(bytes, name);
  if (bytes.size() < kIdentifier.size() || std::memcmp(bytes.data(), kIdentifier.data(), kIdentifier.size()) != 0)
    reader.fail("is not a KTX 2.0 file");
  const auto header = reader.read<Header>(0, "the header");
  Ktx2File file{.image = checked_image(reader, header), .metadata = decoded_metadata(reader, header)};
  const std::string expected = descriptor(file.image.layout);
  const auto found = reader.part(header.descriptor_offset, header.descriptor_bytes, "the format descriptor");
  if (header.descriptor_offset != sizeof(Header) + header.levels * sizeof(LevelIndex))
    reader.fail("the format descriptor does not follow an index of {} mip levels", header.levels);
  if (found.size() != expected.size() || std::memcmp(found.data(), expected.data(), expected.size()) != 0)
    reader.fail("its format descriptor is not that of VkFormat {}, linear", header.vk_format);
  for (int level = 0; level < file.image.levels; ++level) {
    const auto place = reader.read<LevelIndex>(sizeof(Header) + static_cast<std::size_t>(level) * sizeof(LevelIndex),
                                               "the level index");
    const std::size_t size = bytes_of_level(file.image, level);
    if (place.bytes != size || place.uncompressed_bytes != size)
      reader.fail("level {} has {} bytes, expected {}", level, place.bytes, size);
    const auto texels = reader.part(place.offset, size, "a mip level");
    file.image.texels.insert(file.image.texels.end(), texels.begin(), texels.end());
  }
  return file;
}

Ktx2File read_ktx2(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  return decode_ktx2(std::as_bytes(std::span(bytes)), path.string());
}

}  // namespace reliefbench
