#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <csetjmp>
#include <memory>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/png_chunks.h"

namespace reliefbench {
namespace {

/// What libpng reads from or writes to, and what it had to say.
struct PngStream {
  FileBytes rest{};
  std::string written{};
  std::array<char, 128> message{};
};

[[noreturn]] void on_error(png_structp png, png_const_charp text) {
  auto& message = static_cast<PngStream*>(png_get_error_ptr(png))->message;
  fmt::format_to_n(message.data(), message.size() - 1, "{}", text);
  std::longjmp(png_jmpbuf(png), 1);
}
void on_warning(png_structp /*png*/, png_const_charp /*text*/) {}

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto& rest = static_cast<PngStream*>(png_get_io_ptr(png))->rest;
  if (rest.size() < count) png_error(png, "the data end too early");
  std::copy_n(rest.begin(), count, out);
  rest = rest.subspan(count);
}
void write_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<PngStream*>(png_get_io_ptr(png))->written.append(reinterpret_cast<const char*>(bytes), count);
}

/// libpng's structures, freed at the end.
class Png {
 public:
  enum class Mode { read, write };
  explicit Png(Mode mode) : mode_(mode) {
    const auto create = mode == Mode::read ? png_create_read_struct : png_create_write_struct;
    png_ = create(PNG_LIBPNG_VER_STRING, &stream_, on_error, on_warning);
    info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    if (info_ == nullptr) throw std::bad_alloc();
    if (mode == Mode::read)
      png_set_read_fn(png_, &stream_, read_bytes);
    else
      png_set_write_fn(png_, &stream_, write_bytes, nullptr);
  }
  ~Png() {
    mode_ == Mode::read ? png_destroy_read_struct(&png_, &info_, nullptr) : png_destroy_write_struct(&png_, &info_);
  }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  /// Runs calls to libpng; false where it gave up. It leaves them by longjmp, so that `calls` may hold nothing that has
  /// a destructor.
  template <typename Calls>
  [[nodiscard]] bool run(const Calls& calls) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    calls(png_, info_);
    return true;
  }

  PngStream& stream() { return stream_; }
  [[nodiscard]] const char* message() const { return stream_.message.data(); }

 private:
  Mode mode_;
  PngStream stream_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

Image decode_png(FileBytes bytes, const std::string& name) {
  const std::vector<std::uint8_t> checked = checked_png(bytes, name);
  Png file(Png::Mode::read);
  file.stream().rest = checked;
  int channels = 0;
  int bits = 0;
  int stored_bits = 0;
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int passes = 1;
  const bool has_header = file.run([&](png_structp png, png_infop info) {
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // check_shape says it better
    png_read_info(png, info);
    stored_bits = png_get_bit_depth(png, info);
    png_set_expand(png);  // palettes to RGB, 1 to 4 bits to 8, a transparent colour to alpha
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
    passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    width = png_get_image_width(png, info);
    height = png_get_image_height(png, info);
    channels = png_get_channels(png, info);
    bits = png_get_bit_depth(png, info);
  });
  if (!has_header) fail_input("{}: the PNG is corrupt: {}", name, file.message());
  check_shape(width, height, channels, name);

  const std::size_t row_codes = std::size_t{width} * static_cast<std::size_t>(channels);
  const std::size_t row_bytes = row_codes * (bits == 16 ? 2 : 1);
  const auto codes = std::make_unique_for_overwrite<png_byte[]>(row_bytes * height);
  const bool is_whole = file.run([&](png_structp png, png_infop /*info*/) {
    for (int pass = 0; pass < passes; ++pass)
      for (png_uint_32 y = 0; y < height; ++y) png_read_row(png, codes.get() + y * row_bytes, nullptr);
    png_read_end(png, nullptr);
  });
  if (!is_whole) fail_input("{}: the PNG is corrupt: {}", name, file.message());
  const int alpha = channels % 2 == 0 ? channels - 1 : -1;
  Image image = blank_image(static_cast<int>(width), static_cast<int>(height), channels, alpha,
                            fmt::format("{}-bit", stored_bits));
  const std::size_t count = row_codes * height;
  if (bits == 16)
    append_codes<std::uint16_t>(image.pixels, {reinterpret_cast<const std::uint16_t*>(codes.get()), count});
  else
    append_codes<std::uint8_t>(image.pixels, {codes.get(), count});
  return image;
}

std::string encode_png(const ImageSource& source) {
  constexpr std::array kColours{PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA};
  assert(source.type == TexelType::unorm8 || source.type == TexelType::unorm16);
  const bool is_wide = source.type == TexelType::unorm16;
  const std::size_t row_bytes = static_cast<std::size_t>(source.width) * source.channels.size() * (is_wide ? 2 : 1);
  if (source.pixels.size() != row_bytes * static_cast<std::size_t>(source.height))
    fail_environment("a PNG of {}x{}: rows of {} bytes, of {} in all", source.width, source.height, row_bytes,
                     source.pixels.size());
  std::vector<png_text> texts;
  for (const auto& [key, value] : source.metadata) {
    png_text text{};
    text.compression = PNG_TEXT_COMPRESSION_NONE;
    text.key = const_cast<char*>(key.c_str());  // libpng only reads both
    text.text = const_cast<char*>(value.c_str());
    texts.push_back(text);
  }
  Png file(Png::Mode::write);
  const bool is_written = file.run([&](png_structp png, png_infop info) {
    png_set_IHDR(png, info, static_cast<png_uint_32>(source.width), static_cast<png_uint_32>(source.height),
                 is_wide ? 16 : 8, kColours.at(source.channels.size() - 1), PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, source.is_quick ? 1 : 6);
    if (source.is_quick) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);  // trying them all takes longest
    png_set_compression_strategy(png, Z_DEFAULT_STRATEGY);  // libpng's own choice for filtered rows is longer
    if (!texts.empty()) png_set_text(png, info, texts.data(), static_cast<int>(texts.size()));
    png_write_info(png, info);
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
    const auto* rows = reinterpret_cast<png_const_bytep>(source.pixels.data());
    for (int y = 0; y < source.height; ++y) png_write_row(png, rows + static_cast<std::size_t>(y) * row_bytes);
    png_write_end(png, info);
  });
  if (!is_written)
    fail_environment("a PNG of {}x{} cannot be written: {}", source.width, source.height, file.message());
  return std::move(file.stream().written);
}

}  // namespace reliefbench
