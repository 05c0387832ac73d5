#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <tuple>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/exr_attributes.h"

namespace reliefbench {
namespace {

class MemoryReader : public Imf::IStream {
 public:
  explicit MemoryReader(FileBytes bytes) : IStream("memory"), bytes_(bytes) {}
  bool read(char out[], int count) override {
    if (bytes_.size() - at_ < static_cast<std::size_t>(count)) throw std::runtime_error("the file ends too early");
    std::memcpy(out, bytes_.data() + at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t at) override { at_ = std::min<std::size_t>(at, bytes_.size()); }

 private:
  FileBytes bytes_;
  std::size_t at_ = 0;
};

/// OpenEXR sets memory aside for a row of tiles, of any size. They may be larger than the image, but not by far.
void check_tiles(const Imf::Header& header, double width, double height, const std::string& name) {
  constexpr double kAnyway = 1 << 22;  // texels that a row of tiles may always have
  constexpr double kTimes = 4.0;       // as many as the image has
  if (!header.hasTileDescription()) return;
  const Imf::TileDescription& tiles = header.tileDescription();
  const double row = std::ceil(width / tiles.xSize) * tiles.xSize * tiles.ySize;
  if (row > std::max(kAnyway, kTimes * width * height))
    fail_input("{}: the EXR is truncated or corrupt: it has {}x{} texels in tiles of {}x{}", name, width, height,
               tiles.xSize, tiles.ySize);
}

class MemoryWriter : public Imf::OStream {
 public:
  MemoryWriter() : OStream("memory") {}
  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    bytes_.resize(std::max(bytes_.size(), at_ + size));
    std::memcpy(bytes_.data() + at_, bytes, size);
    at_ += size;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t at) override { at_ = at; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

/// The file has its channels in alphabetical order; here R, G and B come first in each layer, and alpha after all
/// layers: what else there is holds heights sooner.
/// returns: whether it is alpha, layer, place in the layer, name in the layer
std::tuple<bool, std::string_view, std::size_t, std::string_view> order(std::string_view name) {
  constexpr std::array<std::string_view, 5> kFirst{"R", "G", "B", "Y", "Z"};
  const std::size_t dot = name.rfind('.') + 1;  // npos + 1 = 0: no layer
  const auto place = std::ranges::find(kFirst, name.substr(dot));
  return {name.substr(dot) == "A", name.substr(0, dot), static_cast<std::size_t>(place - kFirst.begin()),
          name.substr(dot)};
}

const char* sample_of(Imf::PixelType type) {
  return type == Imf::HALF ? "half-float" : type == Imf::FLOAT ? "float" : "32-bit";
}

Image read_first_part(FileBytes bytes, const std::string& name) {
  check_exr_attributes({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  MemoryReader stream(bytes);
  Imf::MultiPartInputFile file(stream, /*numThreads=*/0);
  const Imf::Header& header = file.header(0);
  if (header.hasType() && Imf::isDeepData(header.type())) fail_input("{}: is a deep image; a flat one is needed", name);
  std::vector<std::string> channels;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
      fail_input("{}: channel '{}' has not a value for each texel", name, it.name());
    channels.emplace_back(it.name());
  }
  const Imath::Box2i window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  check_shape(width, height, static_cast<std::int64_t>(channels.size()), name);
  check_tiles(header, static_cast<double>(width), static_cast<double>(height), name);
  std::ranges::sort(channels, {}, [](const std::string& channel) { return order(channel); });

  const auto is_alpha = [](const std::string& channel) { return channel == "A" || channel.ends_with(".A"); };
  const auto alpha = std::ranges::find_if(channels, is_alpha);
  Image image = blank_image(static_cast<int>(width), static_cast<int>(height), static_cast<int>(channels.size()),
                            alpha == channels.end() ? -1 : static_cast<int>(alpha - channels.begin()),
                            sample_of(header.channels()[channels.front()].type));

  // Some rows at a time, so that memory is taken as data come in.
  constexpr int kRows = 256;  // a multiple of every compression's block and of common tiles
  Imf::InputPart part(file, 0);
  const std::size_t row = static_cast<std::size_t>(width) * channels.size();
  for (int y = window.min.y; y <= window.max.y; y += std::min(kRows, window.max.y - y + 1)) {
    const int last = std::min(y + kRows - 1, window.max.y);
    image.pixels.resize(static_cast<std::size_t>(last - window.min.y + 1) * row);
    Imf::FrameBuffer target;
    for (std::size_t i = 0; i < channels.size(); ++i)
      target.insert(channels[i], Imf::Slice::Make(Imf::FLOAT, image.pixels.data() + i, window,
                                                  channels.size() * sizeof(float), row * sizeof(float)));
    part.setFrameBuffer(target);
    part.readPixels(y, last);
  }
  for (std::size_t i = 0; i < channels.size(); ++i)
    if (header.channels()[channels[i]].type == Imf::UINT)
      for (std::size_t at = i; at < image.pixels.size(); at += channels.size())
        image.pixels[at] *= 1.0F / 4294967295.0F;
  image.channels = std::move(channels);
  return image;
}

}  // namespace

Image decode_exr(FileBytes bytes, const std::string& name) {
  try {
    return read_first_part(bytes, name);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    std::string_view what = error.what();
    fail_input("{}: the EXR is truncated or corrupt: {}", name, what.substr(0, what.find_first_of("\r\n")));
  }
}

std::string encode_exr(const ImageSource& source) {
  assert(source.type == TexelType::float32);
  const std::size_t texel_bytes = source.channels.size() * sizeof(float);
  assert(source.pixels.size() ==
         static_cast<std::size_t>(source.width) * static_cast<std::size_t>(source.height) * texel_bytes);
  Imf::Header header(source.width, source.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [key, value] : source.metadata) header.insert(key, Imf::StringAttribute(value));
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < source.channels.size(); ++i) {
    header.channels().insert(source.channels[i], Imf::Channel(Imf::FLOAT));
    // The library reads the pixels through a pointer to char that is not const.
    auto* first = reinterpret_cast<char*>(const_cast<std::byte*>(source.pixels.data())) + i * sizeof(float);
    pixels.insert(source.channels[i],
                  Imf::Slice(Imf::FLOAT, first, texel_bytes, texel_bytes * static_cast<std::size_t>(source.width)));
  }
  MemoryWriter memory;
  try {
    Imf::OutputFile file(memory, header, /*numThreads=*/0);
    file.setFrameBuffer(pixels);
    file.writePixels(source.height);
  } catch (const std::exception& error) {
    fail_environment("an EXR of {}x{} cannot be written: {}", source.width, source.height, error.what());
  }
  return memory.take();
}

}  // namespace reliefbench
