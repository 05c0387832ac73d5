#include <webp/decode.h>

#include <memory>

#include "kernels/base/error.h"
#include "kernels/image/decode.h"

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

}  // namespace reliefbench
