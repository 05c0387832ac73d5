#include "kernels/image/image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/pgm.h"
#include "kernels/image/png_chunks.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

std::string first_line(std::string text) {
  text.resize(std::min(text.size(), text.find_first_of("\r\n")));
  return text;
}

/// The whole file, or its first bytes.
std::vector<std::uint8_t> read_file(const fs::path& path,
                                    std::size_t at_most = std::numeric_limits<std::size_t>::max()) {
  std::error_code error;
  std::vector<std::uint8_t> bytes(std::min<std::size_t>(fs::file_size(path, error), at_most));
  std::ifstream in(path, std::ios::binary);
  if (error || !in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())))
    fail_input("{}: cannot be read", path.string());
  return bytes;
}

/// Codes again, and one correctly rounded division: OpenImageIO multiplies by 1/max, which can be an ulp off.
void round_codes(std::vector<float>& pixels, float max_code) {
  for (float& pixel : pixels) pixel = std::round(pixel * max_code) / max_code;
}

void check_size(int width, int height, const std::string& name) {
  if (width < 2 || height < 2) fail_input("{}: is {}x{} texels; at least 2x2 is needed", name, width, height);
  if (width > kMaxSide || height > kMaxSide)
    fail_input("{}: is {}x{} texels; at most {} a side is possible", name, width, height, kMaxSide);
}

Image read_pixels(OIIO::ImageInput& input, const std::string& name) {
  const OIIO::ImageSpec& spec = input.spec();
  check_size(spec.width, spec.height, name);
  if (spec.depth > 1 || spec.deep) fail_input("{}: is a volume or a deep image; a flat one is needed", name);
  Image image{.width = spec.width,
              .height = spec.height,
              .channels = spec.channelnames,
              .alpha = spec.alpha_channel,
              .pixels = std::vector<float>(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels))};
  const bool complete = input.read_image(0, 0, 0, -1, OIIO::TypeDesc::FLOAT, image.pixels.data());
  const std::string error = first_line(input.geterror());
  if (!complete || !error.empty()) fail_input("{}: truncated or corrupt{}{}", name, error.empty() ? "" : ": ", error);
  if (spec.format == OIIO::TypeDesc::UINT8) round_codes(image.pixels, 255.0F);
  if (spec.format == OIIO::TypeDesc::UINT16) round_codes(image.pixels, 65535.0F);
  return image;
}

}  // namespace

Image load_image(const fs::path& path) {
  const std::string name = path.string();
  std::error_code ignored;
  if (!fs::exists(path, ignored)) fail_input("{}: no such file", name);
  if (!fs::is_regular_file(path, ignored)) fail_input("{}: is not a file", name);

  const std::vector<std::uint8_t> start = read_file(path, 8);
  if (has_pgm_signature(start)) {
    Image image = decode_pgm(read_file(path), path);
    check_size(image.width, image.height, name);
    return image;
  }
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  std::vector<std::uint8_t> png;
  std::optional<OIIO::Filesystem::IOMemReader> memory;  // outlives the input that reads from it
  std::unique_ptr<OIIO::ImageInput> input;
  if (has_png_signature(start)) {
    png = checked_png(read_file(path), path);
    memory.emplace(png.data(), png.size());
    OIIO::Filesystem::IOProxy* proxy = &*memory;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    // Named by content, so that a PNG called .tga is read too.
    input = OIIO::ImageInput::open("memory.png", &config);
  } else {
    input = OIIO::ImageInput::open(name, &config);
  }
  // The library prints a pending message at exit unless it is fetched here.
  const std::string open_error = first_line(OIIO::geterror());
  if (!input) fail_input("{}: not a readable image: {}", name, open_error);

  return read_pixels(*input, name);
}

std::vector<std::uint8_t> encode_png(int width, int height, std::span<const std::uint8_t> rgba8) {
  assert(rgba8.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
  const std::string bytes = encode_image("png", {.width = width,
                                                 .height = height,
                                                 .type = TexelType::unorm8,
                                                 .channels = {"R", "G", "B", "A"},
                                                 .pixels = std::as_bytes(rgba8)});
  return {bytes.begin(), bytes.end()};
}

void write_png(const fs::path& path, int width, int height, std::span<const std::uint8_t> rgba8) {
  const std::vector<std::uint8_t> bytes = encode_png(width, height, rgba8);
  write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace reliefbench
