#include "backends/window/screen.h"

#include <algorithm>

namespace reliefbench {

WindowApi window_api(const BackendRow& row) { return row.id == "vulkan" ? WindowApi::vulkan : WindowApi::opengl; }

bool is_windows_own(std::span<const DeviceInfo> devices, int device_index, const DeviceInfo& windows) {
  const auto asked = std::ranges::find(devices, device_index, &DeviceInfo::index);
  return asked != devices.end() && asked->name == windows.name &&
         std::ranges::count(devices, windows.name, &DeviceInfo::name) == 1;
}

std::unique_ptr<Backend> open_in(const Window& window, const BackendRow& row, int device_index,
                                 const BackendOptions& options) {
  if (window.api() == WindowApi::vulkan) return open_in_vulkan_window(device_index, options);
  if (row.id == "opengl") {
    // A window's OpenGL draws on the display's own device, which need not be the one that is asked for.
    std::unique_ptr<Backend> own = open_in_opengl_window(window, options);
    if (is_windows_own(row.devices(), device_index, own->device())) return own;
  }
  return row.open(device_index, options);
}

std::unique_ptr<Screen> make_screen(const Window& window, Backend& backend) {
  return window.api() == WindowApi::vulkan ? make_vulkan_screen(window, backend) : make_opengl_screen(window, backend);
}

}  // namespace reliefbench
