#include "backends/window.h"

// epoxy goes first: it stands in for the system's GL headers.
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr std::array<std::pair<int, Key>, 6> kKeys = {{{GLFW_KEY_LEFT, Key::left},
                                                       {GLFW_KEY_RIGHT, Key::right},
                                                       {GLFW_KEY_TAB, Key::tab},
                                                       {GLFW_KEY_ESCAPE, Key::escape},
                                                       {GLFW_KEY_R, Key::r},
                                                       {GLFW_KEY_S, Key::s}}};

[[noreturn]] void fail_glfw() {
  const char* words = nullptr;
  glfwGetError(&words);
  fail_environment("no window can be opened ({}); --png FILE draws without one", words == nullptr ? "GLFW" : words);
}

/// GLFW's life.
struct Library {
  Library() {
    if (glfwInit() == GLFW_FALSE) fail_glfw();
  }
  ~Library() { glfwTerminate(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

/// The window's context while it is needed: the backends expect none but their own.
struct Current {
  explicit Current(GLFWwindow* window) { glfwMakeContextCurrent(window); }
  ~Current() { glfwMakeContextCurrent(nullptr); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
};

}  // namespace

struct Window::Impl {
  Library library;
  GLFWwindow* window = nullptr;  // glfwTerminate destroys it
  GLuint texture = 0;
  GLuint framebuffer = 0;
  bool is_dragged = false;
  double x_px = 0;
  double y_px = 0;
  WindowEvents events;

  static Impl& of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }

  static void on_key(GLFWwindow* window, int key, int /*scancode*/, int action, int /*modifiers*/) {
    const auto* const found = std::ranges::find(kKeys, key, &std::pair<int, Key>::first);
    if (action != GLFW_RELEASE && found != kKeys.end()) of(window).events.keys.push_back(found->second);
  }
  static void on_button(GLFWwindow* window, int button, int action, int /*modifiers*/) {
    if (button != GLFW_MOUSE_BUTTON_LEFT) return;
    Impl& self = of(window);
    self.is_dragged = action == GLFW_PRESS;
    glfwGetCursorPos(window, &self.x_px, &self.y_px);
  }
  static void on_move(GLFWwindow* window, double x_px, double y_px) {
    Impl& self = of(window);
    if (!self.is_dragged) return;
    self.events.drag_x_px += x_px - std::exchange(self.x_px, x_px);
    self.events.drag_y_px += y_px - std::exchange(self.y_px, y_px);
  }
  static void on_wheel(GLFWwindow* window, double /*x*/, double y) { of(window).events.wheel += y; }
  static void on_expose(GLFWwindow* window) { of(window).events.is_exposed = true; }

  [[nodiscard]] WindowEvents take() {
    WindowEvents taken = std::exchange(events, {});
    taken.is_closed = glfwWindowShouldClose(window) == GLFW_TRUE;
    return taken;
  }
};

Window::Window(int width_px, int height_px) : impl_(std::make_unique<Impl>()) {
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  // As the OpenGL backend: one thread cannot have contexts of GLX and of EGL in turn.
  glfwWindowHint(GLFW_CONTEXT_CREATION_API, GLFW_EGL_CONTEXT_API);
  impl_->window = glfwCreateWindow(width_px, height_px, "reliefbench", nullptr, nullptr);
  if (impl_->window == nullptr) fail_glfw();
  glfwSetWindowUserPointer(impl_->window, impl_.get());
  glfwSetKeyCallback(impl_->window, Impl::on_key);
  glfwSetMouseButtonCallback(impl_->window, Impl::on_button);
  glfwSetCursorPosCallback(impl_->window, Impl::on_move);
  glfwSetScrollCallback(impl_->window, Impl::on_wheel);
  glfwSetWindowRefreshCallback(impl_->window, Impl::on_expose);
  const Current current(impl_->window);
  glGenTextures(1, &impl_->texture);
  glGenFramebuffers(1, &impl_->framebuffer);
}

Window::~Window() = default;

void Window::set_title(const std::string& title) { glfwSetWindowTitle(impl_->window, title.c_str()); }

void Window::show(std::span<const std::uint8_t> rgba8, int width, int height) {
  glfwShowWindow(impl_->window);
  const Current current(impl_->window);
  int window_width = 0;
  int window_height = 0;
  glfwGetFramebufferSize(impl_->window, &window_width, &window_height);
  const double scale = std::min(static_cast<double>(window_width) / width, static_cast<double>(window_height) / height);
  const int shown_width = static_cast<int>(width * scale);
  const int shown_height = static_cast<int>(height * scale);
  const int left = (window_width - shown_width) / 2;
  const int bottom = (window_height - shown_height) / 2;

  glBindTexture(GL_TEXTURE_2D, impl_->texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba8.data());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->framebuffer);
  glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, impl_->texture, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  glBlitFramebuffer(0, height, width, 0, left, bottom, left + shown_width, bottom + shown_height, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
  glfwSwapBuffers(impl_->window);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR)
    fail_environment("the window's OpenGL: error {:#x} while a frame was shown", error);
}

WindowEvents Window::poll() {
  glfwPollEvents();
  return impl_->take();
}

WindowEvents Window::wait() {
  glfwWaitEvents();
  return impl_->take();
}

}  // namespace reliefbench
