#include "backends/window/screen.h"

namespace reliefbench {

WindowApi window_api(const BackendRow& row) { return row.id == "vulkan" ? WindowApi::vulkan : WindowApi::opengl; }

std::unique_ptr<Backend> open_in(const Window& window, const BackendRow& row, int device_index,
                                 const BackendOptions& options) {
  if (window.api() == WindowApi::vulkan) return open_in_vulkan_window(device_index, options);
  // A window's OpenGL draws on the display's own device, which the first one stands for.
  if (row.id == "opengl" && device_index == 0) return open_in_opengl_window(window, options);
  return row.open(device_index, options);
}

std::unique_ptr<Screen> make_screen(const Window& window, Backend& backend) {
  return window.api() == WindowApi::vulkan ? make_vulkan_screen(window, backend) : make_opengl_screen(window, backend);
}

}  // namespace reliefbench
