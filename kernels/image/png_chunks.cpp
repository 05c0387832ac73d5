#include "kernels/image/png_chunks.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::string_view, 5> kKept{"IHDR", "PLTE", "tRNS", "IDAT", "IEND"};
constexpr std::size_t kFraming = 12;  // length, type and CRC, four bytes each

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

}  // namespace

std::vector<std::uint8_t> checked_png(std::span<const std::uint8_t> bytes, const std::string& name) {
  std::vector<std::uint8_t> kept(kSignature.begin(), kSignature.end());
  std::span<const std::uint8_t> rest = bytes.subspan(kSignature.size());
  while (true) {
    const std::size_t length = rest.size() < kFraming ? 0 : big_endian(rest);
    if (rest.size() < kFraming || rest.size() - kFraming < length) fail_input("{}: the PNG is truncated", name);
    const std::span<const std::uint8_t> chunk = rest.first(kFraming + length);
    rest = rest.subspan(chunk.size());
    // The checksum covers the type and the data.
    const std::span<const std::uint8_t> covered = chunk.subspan(4, 4 + length);
    const std::string_view type(reinterpret_cast<const char*>(covered.data()), 4);
    if (crc32_z(0, covered.data(), covered.size()) != big_endian(chunk.last(4)))
      fail_input("{}: the PNG is corrupt: the checksum of a chunk is wrong", name);
    if (std::find(kKept.begin(), kKept.end(), type) != kKept.end()) kept.insert(kept.end(), chunk.begin(), chunk.end());
    if (type == "IEND") return kept;
  }
}

}  // namespace reliefbench
