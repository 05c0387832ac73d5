#include <Imath/half.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"

namespace reliefbench {
namespace {

/// What libtiff reads from, and its first complaint.
struct TiffStream {
  FileBytes bytes;
  std::size_t at = 0;
  std::string message{};
};

TiffStream& stream_of(thandle_t handle) { return *static_cast<TiffStream*>(handle); }

tmsize_t read_some(thandle_t handle, void* out, tmsize_t count) {
  TiffStream& stream = stream_of(handle);
  const std::size_t left = stream.bytes.size() - std::min(stream.at, stream.bytes.size());
  const std::size_t taken = std::min(left, static_cast<std::size_t>(count));
  if (taken > 0) std::memcpy(out, stream.bytes.data() + stream.at, taken);
  stream.at += taken;
  return static_cast<tmsize_t>(taken);
}
tmsize_t write_none(thandle_t /*handle*/, void* /*bytes*/, tmsize_t /*count*/) { return -1; }
toff_t seek_to(thandle_t handle, toff_t offset, int whence) {
  TiffStream& stream = stream_of(handle);
  const std::size_t base = whence == SEEK_CUR ? stream.at : whence == SEEK_END ? stream.bytes.size() : 0;
  return stream.at = base + offset;
}
int close_none(thandle_t /*handle*/) { return 0; }
toff_t size_of(thandle_t handle) { return stream_of(handle).bytes.size(); }

int on_error(TIFF* /*tiff*/, void* stream, const char* /*module*/, const char* format, va_list arguments) {
  std::string& message = static_cast<TiffStream*>(stream)->message;
  std::array<char, 256> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  if (message.empty()) message = text.data();
  message.resize(std::min(message.size(), message.find_first_of("\r\n")));
  return 1;
}
int on_warning(TIFF* /*tiff*/, void* /*data*/, const char* /*module*/, const char* /*format*/, va_list /*arguments*/) {
  return 1;
}

using File = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

File open(TiffStream& stream, const std::string& name) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &stream);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMaxDecodedBytes);
  File file(TIFFClientOpenExt("memory", "rm", &stream, read_some, write_none, seek_to, close_none, size_of, nullptr,
                              nullptr, options.get()),
            TIFFClose);
  if (!file) fail_input("{}: the TIFF is truncated or corrupt: {}", name, stream.message);
  return file;
}

template <typename T>
T field(TIFF* file, std::uint32_t tag, T fallback) {
  T value = fallback;
  return TIFFGetFieldDefaulted(file, tag, &value) != 0 ? value : fallback;
}

/// How a stored sample becomes a float.
struct SampleRow {
  int format;  ///< SAMPLEFORMAT_
  int bits;
  const char* text;  ///< Image::sample
  float (*value)(const std::byte* sample);
};

template <typename T>
T stored(const std::byte* sample) {
  T value;
  std::memcpy(&value, sample, sizeof(T));
  return value;
}
template <typename T>
float code(const std::byte* sample) {
  return static_cast<float>(stored<T>(sample)) / static_cast<float>(std::numeric_limits<T>::max());
}
template <typename T>
float share_of_range(const std::byte* sample) {
  return static_cast<float>(stored<T>(sample)) * (1.0F / static_cast<float>(std::numeric_limits<T>::max()));
}
template <typename T>
float real(const std::byte* sample) {
  return static_cast<float>(stored<T>(sample));
}
float half_float(const std::byte* sample) { return half(half::FromBits, stored<std::uint16_t>(sample)); }

constexpr std::array kSamples{
    SampleRow{SAMPLEFORMAT_UINT, 8, "8-bit", code<std::uint8_t>},
    SampleRow{SAMPLEFORMAT_UINT, 16, "16-bit", code<std::uint16_t>},
    SampleRow{SAMPLEFORMAT_UINT, 32, "32-bit", share_of_range<std::uint32_t>},
    SampleRow{SAMPLEFORMAT_INT, 8, "signed 8-bit", share_of_range<std::int8_t>},
    SampleRow{SAMPLEFORMAT_INT, 16, "signed 16-bit", share_of_range<std::int16_t>},
    SampleRow{SAMPLEFORMAT_INT, 32, "signed 32-bit", share_of_range<std::int32_t>},
    SampleRow{SAMPLEFORMAT_IEEEFP, 16, "half-float", half_float},
    SampleRow{SAMPLEFORMAT_IEEEFP, 32, "float", real<float>},
    SampleRow{SAMPLEFORMAT_IEEEFP, 64, "double", real<double>},
};

/// Of a sample that grows as what it shows darkens.
float inverted_value(const SampleRow& row, std::byte* sample) {
  if (row.format != SAMPLEFORMAT_UINT) return 1 - row.value(sample);
  for (std::byte& byte : std::span(sample, static_cast<std::size_t>(row.bits) / 8)) byte = ~byte;
  return row.value(sample);  // of the greatest code minus that one, correctly rounded
}

/// Index of the alpha channel: what the tag of extra samples says, else the fourth; -1: none.
int alpha_of(TIFF* file, int colours, int channels) {
  std::uint16_t count = 0;
  std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(file, TIFFTAG_EXTRASAMPLES, &count, &kinds);
  for (int i = 0; i < count; ++i)
    if (kinds[i] != EXTRASAMPLE_UNSPECIFIED && colours + i < channels) return colours + i;
  return count == 0 && channels >= 4 ? 3 : -1;
}

/// Hands over the rows of a plane, from the top, out of strips or tiles.
/// take(y, row): the row's stored bytes, which may be changed
template <typename Take>
bool read_rows(TIFF* file, std::uint16_t plane, int width, int height, std::size_t texel_bytes, const Take& take) {
  const std::size_t row_bytes = static_cast<std::size_t>(width) * texel_bytes;
  if (TIFFIsTiled(file) == 0) {
    std::vector<std::byte> row(std::max(row_bytes, static_cast<std::size_t>(TIFFScanlineSize64(file))));
    for (int y = 0; y < height; ++y) {
      if (TIFFReadScanline(file, row.data(), static_cast<std::uint32_t>(y), plane) < 0) return false;
      take(y, std::span(row).first(row_bytes));
    }
    return true;
  }
  const int tile_width = static_cast<int>(field<std::uint32_t>(file, TIFFTAG_TILEWIDTH, 0));
  const int tile_height = static_cast<int>(field<std::uint32_t>(file, TIFFTAG_TILELENGTH, 0));
  const auto tile_bytes = static_cast<std::size_t>(TIFFTileSize64(file));
  const std::size_t tile_row_bytes = static_cast<std::size_t>(tile_width) * texel_bytes;
  if (tile_width < 1 || tile_height < 1 || tile_bytes > std::size_t{kMaxDecodedBytes} ||
      tile_bytes < tile_row_bytes * static_cast<std::size_t>(tile_height))
    return false;
  const auto tile = std::make_unique_for_overwrite<std::byte[]>(tile_bytes);
  std::vector<std::byte> band;
  for (int top = 0; top < height; top += std::min(tile_height, height - top)) {
    const auto rows = static_cast<std::size_t>(std::min(tile_height, height - top));
    band.resize(rows * row_bytes);
    for (std::size_t left = 0; left < row_bytes; left += tile_row_bytes) {
      const auto x = static_cast<std::uint32_t>(left / texel_bytes);
      if (TIFFReadTile(file, tile.get(), x, static_cast<std::uint32_t>(top), 0, plane) < 0) return false;
      for (std::size_t y = 0; y < rows; ++y)
        std::memcpy(&band[y * row_bytes + left], &tile[y * tile_row_bytes], std::min(tile_row_bytes, row_bytes - left));
    }
    for (std::size_t y = 0; y < rows; ++y)
      take(top + static_cast<int>(y), std::span(band).subspan(y * row_bytes, row_bytes));
  }
  return true;
}

/// An image as it is meant to be seen, of one whose first row and column lie where TIFFTAG_ORIENTATION says.
Image oriented(Image stored, int orientation) {
  if (orientation <= ORIENTATION_TOPLEFT || orientation > ORIENTATION_LEFTBOT) return stored;
  const bool is_transposed = orientation >= ORIENTATION_LEFTTOP;
  const int turn = (orientation - 1) % 4;
  const bool from_right = turn == 1 || turn == 2;
  const bool from_bottom = turn >= 2;
  Image image = stored;
  if (is_transposed) std::swap(image.width, image.height);
  const std::size_t channels = stored.channels.size();
  const float* texel = stored.pixels.data();
  for (int row = 0; row < stored.height; ++row)
    for (int column = 0; column < stored.width; ++column, texel += channels) {
      const int x = is_transposed ? row : column;
      const int y = is_transposed ? column : row;
      const auto to_x = static_cast<std::size_t>(from_right ? image.width - 1 - x : x);
      const auto to_y = static_cast<std::size_t>(from_bottom ? image.height - 1 - y : y);
      std::copy_n(texel, channels, &image.pixels[(to_y * static_cast<std::size_t>(image.width) + to_x) * channels]);
    }
  return image;
}

/// libtiff's own way to 8-bit colours, for all that is no plain grey or RGB: palettes, few bits, YCbCr, CMYK.
Image read_converted(TIFF* file, int width, int height, int orientation, bool is_grey, const TiffStream& stream,
                     const std::string& name) {
  std::array<char, 1024> reason{};
  if (TIFFRGBAImageOK(file, reason.data()) == 0)
    fail_input("{}: a TIFF of a kind that is not read: {}", name, reason.data());
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const auto texels = std::make_unique_for_overwrite<std::uint32_t[]>(count);
  if (TIFFReadRGBAImageOriented(file, static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                                texels.get(), orientation, /*stopOnError=*/1) == 0)
    fail_input("{}: the TIFF is truncated or corrupt: {}", name, stream.message);
  Image image = blank_image(width, height, is_grey ? 1 : 3, /*alpha=*/-1, "8-bit");
  for (const std::uint32_t texel : std::span(texels.get(), count)) {
    const std::array codes{static_cast<std::uint8_t>(TIFFGetR(texel)), static_cast<std::uint8_t>(TIFFGetG(texel)),
                           static_cast<std::uint8_t>(TIFFGetB(texel))};
    append_codes<std::uint8_t>(image.pixels, std::span(codes).first(image.channels.size()));
  }
  return image;
}

}  // namespace

Image decode_tiff(FileBytes bytes, const std::string& name) {
  TiffStream stream{.bytes = bytes};
  const File opened = open(stream, name);
  TIFF* const file = opened.get();
  const std::int64_t width = field<std::uint32_t>(file, TIFFTAG_IMAGEWIDTH, 0);
  const std::int64_t height = field<std::uint32_t>(file, TIFFTAG_IMAGELENGTH, 0);
  const int channels = field<std::uint16_t>(file, TIFFTAG_SAMPLESPERPIXEL, 1);
  check_shape(width, height, channels, name);
  if (field<std::uint32_t>(file, TIFFTAG_IMAGEDEPTH, 1) > 1)
    fail_input("{}: is a volume; a flat image is needed", name);

  const int format = field<std::uint16_t>(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const int bits = field<std::uint16_t>(file, TIFFTAG_BITSPERSAMPLE, 1);
  const int photometric = field<std::uint16_t>(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const bool is_grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
  const auto sample =
      std::ranges::find_if(kSamples, [&](const SampleRow& row) { return row.format == format && row.bits == bits; });
  const int orientation = field<std::uint16_t>(file, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (sample == kSamples.end() || (!is_grey && photometric != PHOTOMETRIC_RGB))
    return oriented(
        read_converted(file, static_cast<int>(width), static_cast<int>(height), orientation, is_grey, stream, name),
        orientation);

  Image image = blank_image(static_cast<int>(width), static_cast<int>(height), channels,
                            alpha_of(file, is_grey ? 1 : 3, channels), sample->text);
  const bool is_separate =
      field<std::uint16_t>(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
  const std::size_t inverted = photometric == PHOTOMETRIC_MINISWHITE ? 1 : 0;  // of a texel's samples, the first ones
  const auto all = static_cast<std::size_t>(channels);
  const std::size_t in_plane = is_separate ? 1 : all;
  const auto sample_bytes = static_cast<std::size_t>(bits) / 8;
  for (std::size_t plane = 0; plane < all; plane += in_plane) {
    const auto take = [&](int y, std::span<std::byte> stored_row) {
      std::byte* row = stored_row.data();
      const std::size_t begin = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) * all;
      const std::size_t end = begin + static_cast<std::size_t>(width) * all;
      if (image.pixels.size() < end) image.pixels.resize(end);
      for (std::size_t at = begin + plane; at < end; at += all)
        for (std::size_t i = 0; i < in_plane; ++i, row += sample_bytes)
          image.pixels[at + i] = plane + i < inverted ? inverted_value(*sample, row) : sample->value(row);
    };
    if (!read_rows(file, static_cast<std::uint16_t>(plane), image.width, image.height, in_plane * sample_bytes, take))
      fail_input("{}: the TIFF is truncated or corrupt: {}", name, stream.message);
  }
  return oriented(std::move(image), orientation);
}

}  // namespace reliefbench
