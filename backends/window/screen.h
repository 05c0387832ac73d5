#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "backends/backend.h"
#include "backends/window/window.h"
#include "kernels/base/size.h"

struct ImDrawData;

namespace reliefbench {

/// RGBA8, on the device that fills a window; what Dear ImGui takes for an ImTextureID. Rows from the top.
struct ScreenPicture {
  ScreenPicture(int width, int height) : width_px(width), height_px(height) {}
  virtual ~ScreenPicture() = default;
  ScreenPicture(const ScreenPicture&) = delete;
  ScreenPicture& operator=(const ScreenPicture&) = delete;

  int width_px;
  int height_px;
};

/// What a window showed. RGBA8, rows from the top.
struct SeenWindow {
  Size size{};  ///< then: it may have another one by now
  std::vector<std::uint8_t> rgba8{};
};

/// The inside of a window. It must go before the backend whose frames it shows, and that before the window.
class Screen {
 public:
  virtual ~Screen() = default;
  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Black. It must go before the screen.
  [[nodiscard]] virtual std::unique_ptr<ScreenPicture> make_picture(int width_px, int height_px) = 0;
  /// The backend's last frame drawn into Target::color, of the picture's size. The screen's own device copies it; the
  /// processor only where the backend draws elsewhere.
  virtual void keep(ScreenPicture& into) = 0;
  /// rgba8: of the picture's size
  virtual void fill(ScreenPicture& into, std::span<const std::uint8_t> rgba8) = 0;
  /// Shows what Dear ImGui has drawn. seen: gets what the window then shows; null: nobody asks
  virtual void present(const ImDrawData& drawn, SeenWindow* seen) = 0;
};

/// The API that can show a backend's frames without the processor; OpenGL for one that has no windows.
[[nodiscard]] WindowApi window_api(const BackendRow& row);

/// Opens a device so that the window can show its frames: where that is of the window's API, on the window's own
/// device. throws: as BackendRow::open; Error(environment): the device presents nothing into windows
[[nodiscard]] std::unique_ptr<Backend> open_in(const Window& window, const BackendRow& row, int device_index,
                                               const BackendOptions& options);

/// Whether a window draws on the device of that index, as far as their names tell: not where two have one name.
[[nodiscard]] bool is_windows_own(std::span<const DeviceInfo> devices, int device_index, const DeviceInfo& windows);

/// backend: of open_in()
[[nodiscard]] std::unique_ptr<Screen> make_screen(const Window& window, Backend& backend);

// One of each API, a file each.
[[nodiscard]] std::unique_ptr<Backend> open_in_opengl_window(const Window& window, const BackendOptions& options);
[[nodiscard]] std::unique_ptr<Screen> make_opengl_screen(const Window& window, Backend& backend);
[[nodiscard]] std::unique_ptr<Backend> open_in_vulkan_window(int device_index, const BackendOptions& options);
[[nodiscard]] std::unique_ptr<Screen> make_vulkan_screen(const Window& window, Backend& backend);

}  // namespace reliefbench
