#include "kernels/image/image.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using namespace std::string_view_literals;

bool has(FileBytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() && std::memcmp(&bytes[at], text.data(), text.size()) == 0;
}

bool is_png(FileBytes bytes) { return has(bytes, 0, "\x89PNG\r\n\x1a\n"); }
bool is_tiff(FileBytes bytes) {  // little or big endian, classic or BigTIFF
  return has(bytes, 0, "II*\0"sv) || has(bytes, 0, "MM\0*"sv) || has(bytes, 0, "II+\0"sv) || has(bytes, 0, "MM\0+"sv);
}
bool is_exr(FileBytes bytes) { return has(bytes, 0, "\x76\x2f\x31\x01"); }
bool is_webp(FileBytes bytes) { return has(bytes, 0, "RIFF") && has(bytes, 8, "WEBP"); }
bool is_netpbm(FileBytes bytes) {
  return bytes.size() >= 3 && bytes[0] == 'P' && "2356"sv.find(static_cast<char>(bytes[1])) != std::string_view::npos &&
         (std::isspace(bytes[2]) != 0 || bytes[2] == '#');
}
bool is_tga2(FileBytes bytes) {
  constexpr std::string_view kFooter = "TRUEVISION-XFILE.\0"sv;
  return bytes.size() > kFooter.size() && has(bytes, bytes.size() - kFooter.size(), kFooter);
}

struct FileFormat {
  bool (*is_it)(FileBytes bytes);
  Image (*decode)(FileBytes bytes, const std::string& name);
};
constexpr std::array kFileFormats{FileFormat{is_png, decode_png},       FileFormat{is_tiff, decode_tiff},
                                  FileFormat{is_exr, decode_exr},       FileFormat{is_webp, decode_webp},
                                  FileFormat{is_netpbm, decode_netpbm}, FileFormat{is_tga2, decode_tga}};

bool is_called_tga(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".tga";
}

std::vector<std::uint8_t> read_image_file(const fs::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (!fs::exists(path, error)) fail_input("{}: no such file", name);
  if (!fs::is_regular_file(path, error)) fail_input("{}: is not a file", name);
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > std::uintmax_t{kMaxFileBytes})
    fail_input("{}: has {} bytes; at most {} GiB are read", name, size, kMaxFileBytes >> 30);
  std::vector<std::uint8_t> bytes(error ? 0 : size);
  std::ifstream in(path, std::ios::binary);
  if (error || !in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    fail_input("{}: cannot be read", name);
  return bytes;
}

}  // namespace

void check_shape(std::int64_t width, std::int64_t height, std::int64_t channels, const std::string& name) {
  if (channels < 1) fail_input("{}: has no channels", name);
  if (channels > kMaxChannels) fail_input("{}: has {} channels; at most {} are read", name, channels, kMaxChannels);
  if (width < 2 || height < 2) fail_input("{}: is {}x{} texels; at least 2x2 is needed", name, width, height);
  if (width > kMaxSide || height > kMaxSide)
    fail_input("{}: is {}x{} texels; at most {} a side is possible", name, width, height, kMaxSide);
  if (const std::int64_t decoded = width * height * channels * std::int64_t{sizeof(float)}; decoded > kMaxDecodedBytes)
    fail_input("{}: {}x{} texels with {} channels take {:.1f} GiB decoded; at most {} GiB are read", name, width,
               height, channels, static_cast<double>(decoded) * 0x1p-30, kMaxDecodedBytes >> 30);
}

Image blank_image(int width, int height, int channels, int alpha, std::string sample) {
  Image image{
      .width = width, .height = height, .channels = {}, .alpha = alpha, .sample = std::move(sample), .pixels = {}};
  const bool is_grey = channels - (alpha >= 0 ? 1 : 0) == 1;
  for (int i = 0; i < channels; ++i) {
    if (i == alpha)
      image.channels.emplace_back("A");
    else if (i < 3)
      image.channels.emplace_back(1, is_grey ? 'Y' : "RGB"[i]);
    else
      image.channels.push_back(fmt::format("channel{}", i));
  }
  image.pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                       static_cast<std::size_t>(channels));
  return image;
}

Image load_image(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_image_file(path);
  const auto format = std::ranges::find_if(kFileFormats, [&](const FileFormat& row) { return row.is_it(bytes); });
  if (format != kFileFormats.end()) return format->decode(bytes, path.string());
  if (is_called_tga(path)) return decode_tga(bytes, path.string());
  fail_input("{}: not a readable image: PNG, TIFF, EXR, WebP, TGA, PGM and PPM are read", path.string());
}

std::vector<std::uint8_t> encode_png(int width, int height, std::span<const std::uint8_t> rgba8) {
  const std::string bytes = encode_png({.width = width,
                                        .height = height,
                                        .type = TexelType::unorm8,
                                        .channels = {"R", "G", "B", "A"},
                                        .pixels = std::as_bytes(rgba8),
                                        .is_quick = true});
  return {bytes.begin(), bytes.end()};
}

void write_png(const fs::path& path, int width, int height, std::span<const std::uint8_t> rgba8) {
  const std::vector<std::uint8_t> bytes = encode_png(width, height, rgba8);
  write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace reliefbench
