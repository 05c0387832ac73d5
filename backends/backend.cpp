#include "backends/backend.h"

#include <array>

#include "kernels/base/error.h"

namespace reliefbench {

std::string_view timer_id(Timer timer) {
  switch (timer) {
    case Timer::fenced_wall:
      return "fenced_wall";
    case Timer::gl_time_elapsed:
      return "gl_time_elapsed";
    case Timer::gl_timestamp:
      return "gl_timestamp";
    case Timer::vk_timestamp:
      return "vk_timestamp";
  }
  return "?";
}

std::span<const BackendRow> backends() {
  static const std::array rows = {
      BackendRow{.id = "opengl",
                 .description = "OpenGL 4.5 through EGL, headless",
                 .dialect = Dialect::opengl,
                 .real = true,
                 .devices = opengl_devices,
                 .open = open_opengl},
      BackendRow{.id = "vulkan",
                 .description = "Vulkan 1.2 or later, headless",
                 .dialect = Dialect::vulkan,
                 .real = true,
                 .devices = vulkan_devices,
                 .open = open_vulkan},
      BackendRow{.id = "null",
                 .description = "no GPU: made-up times and hits, the same in every run (for tests)",
                 .dialect = Dialect::vulkan,
                 .real = false,
                 .devices = null_devices,
                 .open = open_null},
  };
  return rows;
}

const BackendRow& find_backend(std::string_view id) {
  std::string choices;
  for (const BackendRow& row : backends()) {
    if (row.id == id) return row;
    choices += fmt::format("{}{}", choices.empty() ? "" : ", ", row.id);
  }
  fail_input("unknown backend '{}' (expected one of {})", id, choices);
}

std::size_t level_bytes(const TextureDesc& desc, int level) {
  return static_cast<std::size_t>(level_side(desc.width, level)) *
         static_cast<std::size_t>(level_side(desc.height, level)) * static_cast<std::size_t>(desc.layout.bytes());
}

std::size_t texture_bytes(const TextureDesc& desc) {
  std::size_t bytes = 0;
  for (int level = 0; level < desc.levels; ++level) bytes += level_bytes(desc, level);
  return bytes;
}

TextureDesc texture_desc(const TextureImage& image, Wrap wrap) {
  return {.width = image.width,
          .height = image.height,
          .layout = image.layout,
          .levels = image.levels,
          .texels = image.texels,
          .wrap = wrap};
}

}  // namespace reliefbench
