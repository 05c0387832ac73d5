#include <webp/decode.h>
#include <webp/encode.h>

#include <memory>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"
#include "kernels/image/image.h"

namespace reliefbench {

Image decode_webp(FileBytes bytes, const std::string& name) {
  WebPBitstreamFeatures features{};
  if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
    fail_input("{}: the WebP is truncated or corrupt", name);
  if (features.has_animation != 0) fail_input("{}: is an animated WebP; a still one is needed", name);
  const int channels = features.has_alpha != 0 ? 4 : 3;
  check_shape(features.width, features.height, channels, name);

  const auto decode = channels == 4 ? WebPDecodeRGBA : WebPDecodeRGB;
  const std::unique_ptr<std::uint8_t, decltype(&WebPFree)> codes(
      decode(bytes.data(), bytes.size(), &features.width, &features.height), WebPFree);
  if (!codes) fail_input("{}: the WebP is truncated or corrupt", name);
  Image image = blank_image(features.width, features.height, channels, channels == 4 ? 3 : -1, "8-bit");
  append_codes<std::uint8_t>(image.pixels, {codes.get(), image.pixels.capacity()});
  return image;
}

std::vector<std::uint8_t> encode_webp(int width, int height, std::span<const std::uint8_t> rgba8) {
  constexpr float kQuality = 90;  // of 100
  WebPConfig config;
  WebPPicture picture;
  if (WebPConfigPreset(&config, WEBP_PRESET_PHOTO, kQuality) == 0 || WebPPictureInit(&picture) == 0)
    fail_environment("WebP: the library is of another version than its headers");
  config.method = 2;  // 0 to 6, quick to small
  picture.width = width;
  picture.height = height;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const bool is_made =
      WebPPictureImportRGBX(&picture, rgba8.data(), 4 * width) != 0 && WebPEncode(&config, &picture) != 0;
  WebPPictureFree(&picture);
  std::vector<std::uint8_t> bytes(writer.mem, writer.mem + writer.size);
  WebPMemoryWriterClear(&writer);
  if (!is_made) fail_input("a picture of {} x {} makes no WebP", width, height);
  return bytes;
}

}  // namespace reliefbench
