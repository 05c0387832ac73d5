#pragma once
#include <memory>
#include <string>

#include "kernels/base/size.h"

struct GLFWwindow;

namespace reliefbench {

/// What draws into a window.
enum class WindowApi { opengl, vulkan };

struct WindowOptions {
  WindowApi api = WindowApi::opengl;
  Size size{};         ///< pixels
  bool debug = false;  ///< as BackendOptions
};

/// A window with Dear ImGui, which hears of the pointer and the keys in it. One at a time.
class Window {
 public:
  /// Not seen before show(). throws: Error(environment): no display, or not this API on it
  explicit Window(const WindowOptions& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void show() const;
  void hide() const;
  void set_title(const std::string& title) const;
  /// Takes in what happened; waits for it, no longer than so many seconds.
  void take_events(double wait_s) const;
  [[nodiscard]] bool is_closed() const;
  [[nodiscard]] Size size() const;  ///< pixels
  [[nodiscard]] WindowApi api() const { return options_.api; }
  [[nodiscard]] GLFWwindow* handle() const { return window_; }

 private:
  struct Library;
  WindowOptions options_;
  std::unique_ptr<Library> library_;
  GLFWwindow* window_ = nullptr;  // its library destroys it
};

}  // namespace reliefbench
