#include "backends/window/screen.h"

namespace reliefbench {

WindowApi window_api(const BackendRow& row) { return row.id == "vulkan" ? WindowApi::vulkan : WindowApi::opengl; }

std::unique_ptr<Backend> open_in(const Window& window, const BackendRow& row, int device_index,
                                 const BackendOptions& options) {
  if (window.api() == WindowApi::vulkan) return open_in_vulkan_window(device_index, options);
  if (row.id == "opengl") {
    // A window's OpenGL draws on the display's own device, which need not be the one that is asked for.
    const std::vector<DeviceInfo> devices = row.devices();
    std::unique_ptr<Backend> own = open_in_opengl_window(window, options);
    const auto place = static_cast<std::size_t>(device_index);
    if (device_index >= 0 && place < devices.size() && devices[place].name == own->device().name) return own;
  }
  return row.open(device_index, options);
}

std::unique_ptr<Screen> make_screen(const Window& window, Backend& backend) {
  return window.api() == WindowApi::vulkan ? make_vulkan_screen(window, backend) : make_opengl_screen(window, backend);
}

}  // namespace reliefbench
