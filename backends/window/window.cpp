#include "backends/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <imgui.h>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

[[noreturn]] void fail_glfw() {
  const char* words = nullptr;
  glfwGetError(&words);
  fail_environment("no window can be opened ({}); --png FILE draws without one", words == nullptr ? "GLFW" : words);
}

void hint_context(const WindowOptions& options) {
  if (options.api == WindowApi::vulkan) {
    glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
    return;
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, options.debug ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  // As the OpenGL backend: one thread cannot have contexts of GLX and of EGL in turn.
  glfwWindowHint(GLFW_CONTEXT_CREATION_API, GLFW_EGL_CONTEXT_API);
}

}  // namespace

/// GLFW's and Dear ImGui's life.
struct Window::Library {
  Library() {
    if (glfwInit() == GLFW_FALSE) fail_glfw();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
  }
  ~Library() {
    if (ImGui::GetIO().BackendPlatformUserData != nullptr) ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    glfwTerminate();
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

Window::Window(const WindowOptions& options) : options_(options), library_(std::make_unique<Library>()) {
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  hint_context(options);
  window_ = glfwCreateWindow(options.size.width, options.size.height, "reliefbench", nullptr, nullptr);
  if (window_ == nullptr) fail_glfw();
  ImGui_ImplGlfw_InitForOther(window_, true);
}

Window::~Window() = default;

void Window::show() const { glfwShowWindow(window_); }

void Window::hide() const { glfwHideWindow(window_); }

void Window::set_title(const std::string& title) const { glfwSetWindowTitle(window_, title.c_str()); }

void Window::take_events(double wait_s) const {
  wait_s > 0 ? glfwWaitEventsTimeout(wait_s) : glfwPollEvents();
  ImGui_ImplGlfw_NewFrame();
}

bool Window::is_closed() const { return glfwWindowShouldClose(window_) == GLFW_TRUE; }

Size Window::size() const {
  Size size;
  glfwGetFramebufferSize(window_, &size.width, &size.height);
  return size;
}

}  // namespace reliefbench
