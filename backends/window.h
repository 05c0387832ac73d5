#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

enum class Key { left, right, tab, escape, r, s };

/// What happened since the last look.
struct WindowEvents {
  double drag_x_px = 0;  ///< of the pointer with the left button down; rightwards
  double drag_y_px = 0;  ///< downwards
  double wheel = 0;      ///< notches, away from the user
  std::vector<Key> keys{};
  bool is_exposed = false;  ///< what it showed is to be shown again
  bool is_closed = false;
};

/// A window for frames that were drawn elsewhere: it draws nothing itself, so that all backends look alike. One at a
/// time.
class Window {
 public:
  /// Not seen before the first show(). throws: Error(environment): no display, no OpenGL on it
  Window(int width_px, int height_px);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void set_title(const std::string& title);
  /// Shows a frame as large as fits, in its own proportions. rgba8: width x height, rows from the top
  void show(std::span<const std::uint8_t> rgba8, int width, int height);
  [[nodiscard]] WindowEvents poll();  ///< what there is
  [[nodiscard]] WindowEvents wait();  ///< the same, once there is something

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace reliefbench
