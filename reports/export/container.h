#pragma once
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "kernels/image/texture_image.h"

namespace reliefbench {

/// A kind of file that textures ship in.
struct Container {
  std::string_view id;  ///< also the extension
  std::string_view holds_what;
  bool is_top_down;  ///< a picture, which engines whose v runs up turn over; else texels as they lie in memory
  bool (*holds)(const TextureImage& image);  ///< without loss
  std::string (*encode)(const TextureImage& image, const std::map<std::string, std::string>& metadata);
};
[[nodiscard]] std::span<const Container> containers();
[[nodiscard]] const Container& find_container(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// Rows from the bottom.
[[nodiscard]] TextureImage turned_over(const TextureImage& image);
/// The same values before more channels, of zeros. image: no blocks
[[nodiscard]] TextureImage with_channels(const TextureImage& image, int channels);
/// The same values as floats, exactly: unorms as code / greatest code, correctly rounded.
[[nodiscard]] TextureImage as_floats(const TextureImage& image);

}  // namespace reliefbench
