#include "tuner/cli/options.h"

#include <charconv>

#include "kernels/base/error.h"

namespace reliefbench {

void set_size(HeightmapSpec& spec, const std::string& text) {
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, spec.width);
  const bool has_height = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_height ? std::from_chars(width.ptr + 1, end, spec.height) : width;
  if (!has_height || height.ec != std::errc() || height.ptr != end)
    fail_input("--size {}: expected WIDTHxHEIGHT in texels, as in 256x256", text);
}

}  // namespace reliefbench
