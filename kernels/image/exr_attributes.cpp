#include "kernels/image/exr_attributes.h"

#include <OpenEXR/ImfVersion.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string_view take_text(std::string_view& rest) {
  const std::string_view text = rest.substr(0, rest.find('\0'));
  rest.remove_prefix(std::min(text.size() + 1, rest.size()));
  return text;
}

static_assert(std::endian::native == std::endian::little);  // as the file is
/// bytes: four at least
std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

/// Channels, each a name and 16 bytes, and behind them an empty name.
bool is_list_of_channels(std::string_view value) {
  constexpr std::size_t kChannel = 16;
  while (!value.empty() && !take_text(value).empty()) {
    if (value.size() < kChannel) return false;
    value.remove_prefix(kChannel);
  }
  return value.empty();
}

/// Texts, each behind its length.
bool is_list_of_texts(std::string_view value) {
  while (value.size() >= 4) {
    const std::uint32_t length = number_at(value, 0);
    value.remove_prefix(4);
    if (length > value.size()) return false;
    value.remove_prefix(length);
  }
  return value.empty();
}

/// Width, height, and 4 bytes a pixel.
bool is_preview(std::string_view value) {
  constexpr std::size_t kSizes = 8;
  if (value.size() < kSizes || value.size() % 4 != 0) return false;
  return std::uint64_t{number_at(value, 0)} * number_at(value, 4) == (value.size() - kSizes) / 4;
}

struct AttributeType {
  std::string_view id;
  std::size_t bytes = 0;  ///< of each value; 0: `is_whole` tells
  bool (*is_whole)(std::string_view value) = nullptr;
};

/// OpenEXR's own types; others, and texts, it reads by their size.
constexpr AttributeType kTypes[] = {
    {"box2f", 16},
    {"box2i", 16},
    {"chlist", 0, is_list_of_channels},
    {"chromaticities", 32},
    {"compression", 1},
    {"deepImageState", 1},
    {"double", 8},
    {"envmap", 1},
    {"float", 4},
    {"int", 4},
    {"keycode", 28},
    {"lineOrder", 1},
    {"m33d", 72},
    {"m33f", 36},
    {"m44d", 128},
    {"m44f", 64},
    {"preview", 0, is_preview},
    {"rational", 8},
    {"stringvector", 0, is_list_of_texts},
    {"tiledesc", 9},
    {"timecode", 8},
    {"v2d", 16},
    {"v2f", 8},
    {"v2i", 8},
    {"v3d", 24},
    {"v3f", 12},
    {"v3i", 12},
};

bool has_size_of(std::string_view type, std::string_view value) {
  const auto* const row = std::ranges::find(kTypes, type, &AttributeType::id);
  if (row == std::end(kTypes)) return true;
  return row->is_whole != nullptr ? row->is_whole(value) : value.size() == row->bytes;
}

}  // namespace

void check_exr_attributes(std::string_view file, const std::string& name) {
  constexpr std::size_t kVersion = 4;
  constexpr std::size_t kFirstHeader = 8;
  constexpr std::size_t kSize = 4;
  if (file.size() < kFirstHeader) return;
  const bool has_parts = Imf::isMultiPart(static_cast<int>(number_at(file, kVersion)));
  std::string_view rest = file.substr(kFirstHeader);
  while (!rest.empty()) {
    const std::string_view attribute = take_text(rest);
    if (attribute.empty()) {  // the end of a header; another at once is that of the last one
      if (!has_parts || rest.starts_with('\0')) return;
      continue;
    }
    const std::string_view type = take_text(rest);
    if (rest.size() < kSize) return;
    const std::uint32_t size = number_at(rest, 0);
    rest.remove_prefix(kSize);
    if (size > rest.size())
      fail_input("{}: the EXR is truncated or corrupt: an attribute claims {} bytes, {} are left", name, size,
                 rest.size());
    if (!has_size_of(type, rest.substr(0, size)))
      fail_input("{}: the EXR is truncated or corrupt: an attribute of type {} has {} bytes", name, type, size);
    rest.remove_prefix(size);
  }
}

}  // namespace reliefbench
