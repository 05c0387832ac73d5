#include "reports/export/container.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "kernels/base/suggest.h"
#include "kernels/image/dds.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/map_texture.h"

namespace reliefbench {
namespace {

using Metadata = std::map<std::string, std::string>;

bool holds_all(const TextureImage& /*image*/) { return true; }
bool is_flat_unorm8(const TextureImage& image) { return image.levels == 1 && image.layout.type == TexelType::unorm8; }
bool is_flat_unorm(const TextureImage& image) {
  return is_flat_unorm8(image) || (image.levels == 1 && image.layout.type == TexelType::unorm16);
}
/// Blocks are no texels any more once they are written as floats: what reads those makes others.
bool is_flat(const TextureImage& image) { return image.levels == 1 && !is_of_blocks(image.layout.type); }
bool has_dxgi_format(const TextureImage& image) {
  return image.layout.type != TexelType::eac && image.layout.type != TexelType::astc;
}

/// Pictures have no two channels.
TextureImage as_picture(const TextureImage& image) {
  return image.layout.channels == 2 ? with_channels(image, 3) : image;
}

ImageSource source_of(const TextureImage& picture, const Metadata& metadata) {
  static const std::vector<std::string> colours = {"R", "G", "B", "A"};
  const bool is_grey = picture.layout.channels == 1;
  return {.width = picture.width,
          .height = picture.height,
          .type = picture.layout.type,
          .channels = is_grey ? std::vector<std::string>{"Y"}
                              : std::vector<std::string>(colours.begin(), colours.begin() + picture.layout.channels),
          .pixels = picture.texels,
          .metadata = metadata};
}

std::string as_ktx2(const TextureImage& image, const Metadata& metadata) {
  return encode_ktx2({.image = image, .metadata = metadata});
}
std::string as_dds(const TextureImage& image, const Metadata& /*metadata*/) { return encode_dds(image); }
std::string as_png(const TextureImage& image, const Metadata& metadata) {
  const TextureImage picture = as_picture(image);
  return encode_png(source_of(picture, metadata));
}
std::string as_tga(const TextureImage& image, const Metadata& metadata) {
  const TextureImage picture = as_picture(image);
  return encode_tga(source_of(picture, metadata));
}
std::string as_exr(const TextureImage& image, const Metadata& metadata) {
  const TextureImage picture = as_picture(as_floats(image));
  return encode_exr(source_of(picture, metadata));
}

constexpr std::array kContainers = {
    Container{"ktx2", "every format, with its mip levels", false, holds_all, as_ktx2},
    Container{"dds", "every format but EAC and ASTC, with its mip levels", false, has_dxgi_format, as_dds},
    Container{"png", "8 and 16 bits, one level", true, is_flat_unorm, as_png},
    Container{"tga", "8 bits, one level", true, is_flat_unorm8, as_tga},
    Container{"exr", "every format but blocks, as floats, one level", true, is_flat, as_exr},
};

}  // namespace

std::span<const Container> containers() { return kContainers; }

const Container& find_container(std::string_view id) { return find_row(kContainers, "kind of texture file", id); }

TextureImage turned_over(const TextureImage& image) {
  TextureImage turned = image;
  std::size_t begin = 0;
  for (int level = 0; level < image.levels; ++level) {
    const std::size_t row =
        static_cast<std::size_t>(level_side(image.width, level)) * static_cast<std::size_t>(image.layout.bytes());
    const auto rows = static_cast<std::size_t>(level_side(image.height, level));
    for (std::size_t y = 0; y < rows; ++y)
      std::memcpy(&turned.texels[begin + y * row], &image.texels[begin + (rows - 1 - y) * row], row);
    begin += rows * row;
  }
  return turned;
}

TextureImage with_channels(const TextureImage& image, int channels) {
  TextureImage wider = image;
  wider.layout.channels = channels;
  wider.texels.clear();
  const auto texel = static_cast<std::size_t>(image.layout.bytes());
  const auto added = static_cast<std::size_t>(wider.layout.bytes()) - texel;
  for (std::size_t at = 0; at < image.texels.size(); at += texel) {
    const auto begin = image.texels.begin() + static_cast<std::ptrdiff_t>(at);
    wider.texels.insert(wider.texels.end(), begin, begin + static_cast<std::ptrdiff_t>(texel));
    wider.texels.resize(wider.texels.size() + added);
  }
  return wider;
}

TextureImage as_floats(const TextureImage& image) {
  if (image.layout.type == TexelType::float32) return image;
  TextureImage floats = image;
  floats.layout.type = TexelType::float32;
  floats.texels.clear();
  for (int level = 0; level < image.levels; ++level) {
    std::vector<std::vector<float>> channels;
    channels.reserve(static_cast<std::size_t>(image.layout.channels));
    for (int c = 0; c < image.layout.channels; ++c) channels.push_back(read_channel(image, c, level));
    std::vector<float> texels;
    for (std::size_t i = 0; i < channels.front().size(); ++i)
      for (const std::vector<float>& channel : channels) texels.push_back(channel[i]);
    const auto bytes = std::as_bytes(std::span(texels));
    floats.texels.insert(floats.texels.end(), bytes.begin(), bytes.end());
  }
  return floats;
}

}  // namespace reliefbench
