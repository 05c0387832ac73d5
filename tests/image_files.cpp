#include "tests/image_files.h"

#include <tiffio.h>
#include <webp/encode.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <span>

#include "kernels/image/encode_image.h"

namespace reliefbench {
namespace {

using Channels = std::vector<std::string>;

template <typename Code>
std::string codes_of(const TestImage& image) {
  std::string bytes;
  for (const float pixel : image.pixels) {
    const auto code = static_cast<Code>(nearest_code(pixel, image.type));
    bytes.append(reinterpret_cast<const char*>(&code), sizeof(code));
  }
  return bytes;
}

std::string stored(const TestImage& image) {
  switch (image.type) {
    case TexelType::unorm8:
    case TexelType::rgtc:
    case TexelType::bc7:
      return codes_of<std::uint8_t>(image);
    case TexelType::unorm16:
    case TexelType::float16:
    case TexelType::eac:
    case TexelType::astc:
      return codes_of<std::uint16_t>(image);
    case TexelType::float32:
      return codes_of<std::uint32_t>(image);
  }
  return {};
}

Channels names_of(int channels) {
  if (channels < 3) return channels == 1 ? Channels{"Y"} : Channels{"Y", "A"};
  return channels == 3 ? Channels{"R", "G", "B"} : Channels{"R", "G", "B", "A"};
}

void write_tiff(const std::filesystem::path& path, const TestImage& image) {
  std::string bytes = stored(image);
  TIFF* file = TIFFOpen(path.c_str(), "w");
  ASSERT_NE(file, nullptr);
  const bool is_float = image.type == TexelType::float32 || image.type == TexelType::float16;
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, image.width);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, image.height);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, image.channels);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, TexelLayout{.type = image.type, .channels = 1}.bytes() * 8);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, image.channels < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 5);
  const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
  if (image.channels % 2 == 0) TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  const std::size_t row = bytes.size() / static_cast<std::size_t>(image.height);
  for (int y = 0; y < image.height; ++y)
    ASSERT_EQ(TIFFWriteScanline(file, &bytes[static_cast<std::size_t>(y) * row], static_cast<std::uint32_t>(y)), 1);
  TIFFClose(file);
}

/// Rows from the bottom, blue first, without compression.
std::string tga(const TestImage& image) {
  const auto low = [](int value) { return static_cast<char>(value & 255); };
  const bool is_grey = image.channels == 1;
  std::string bytes(12, '\0');
  bytes[2] = is_grey ? 3 : 2;
  for (const int side : {image.width, image.height}) bytes += {low(side), low(side >> 8)};
  bytes += {low(8 * image.channels), low(image.channels == 4 ? 8 : 0)};
  const std::string codes = stored(image);
  const std::size_t row = codes.size() / static_cast<std::size_t>(image.height);
  for (std::size_t end = codes.size(); end > 0; end -= row)
    for (std::size_t i = end - row; i < end; i += static_cast<std::size_t>(image.channels)) {
      std::string texel = codes.substr(i, static_cast<std::size_t>(image.channels));
      if (!is_grey) std::swap(texel[0], texel[2]);
      bytes += texel;
    }
  return bytes;
}

std::string webp(const TestImage& image) {
  const std::string codes = stored(image);
  const auto* rgb = reinterpret_cast<const std::uint8_t*>(codes.data());
  std::uint8_t* out = nullptr;
  const auto encode = image.channels == 4 ? WebPEncodeLosslessRGBA : WebPEncodeLosslessRGB;
  const std::size_t size = encode(rgb, image.width, image.height, image.width * image.channels, &out);
  std::string bytes(reinterpret_cast<const char*>(out), size);
  WebPFree(out);
  return bytes;
}

}  // namespace

void write_image(const std::filesystem::path& path, const TestImage& image) {
  const std::string extension = path.extension().string();
  if (extension == ".tif") {
    write_tiff(path, image);
    return;
  }
  const std::string codes = stored(image);
  ImageSource source{.width = image.width,
                     .height = image.height,
                     .type = image.type,
                     .channels = names_of(image.channels),
                     .pixels = std::as_bytes(std::span(codes))};
  if (extension == ".png") {
    write_bytes(path, encode_png(source));
  } else if (extension == ".exr") {
    source.type = TexelType::float32;
    source.pixels = std::as_bytes(std::span(image.pixels));
    write_bytes(path, encode_exr(source));
  } else if (extension == ".tga") {
    write_bytes(path, tga(image));
  } else if (extension == ".webp") {
    write_bytes(path, webp(image));
  } else {
    ASSERT_EQ(extension, image.channels == 1 ? ".pgm" : ".ppm");
    write_bytes(path, fmt::format("P{}\n{} {}\n255\n", image.channels == 1 ? 5 : 6, image.width, image.height) + codes);
  }
}

std::vector<float> code_ramp(std::size_t count, int codes) {
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(static_cast<float>(static_cast<int>(i) % codes) / static_cast<float>(codes - 1));
  return values;
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace reliefbench
