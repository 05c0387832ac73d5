#pragma once
#include <epoxy/egl.h>

#include <string>
#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {

/// What an error code of eglGetError says has failed.
[[nodiscard]] Fault fault_of_egl(EGLint error);

/// The displays of this machine that may offer OpenGL without a window system, each device once: EGL's device
/// enumeration, then Mesa's surfaceless platform where it adds a device. Displays stay initialised for the life of the
/// process: EGL hands the same one to every caller and does not count its users. Prints nothing, never throws for a
/// missing library or a device that cannot be opened.
[[nodiscard]] std::vector<EGLDisplay> egl_displays();

/// The PCI address of a display's device, by its DRM device file; "" where EGL does not tell, as of software.
[[nodiscard]] std::string pci_address(EGLDisplay display);

/// An OpenGL 4.5 core context with GL_ARB_gl_spirv: a headless one of its own, or a window's.
class EglContext {
 public:
  /// Of a context that somebody else made and will destroy.
  struct Borrowed {
    EGLDisplay display;
    EGLSurface surface;
    EGLContext context;
  };
  /// throws: Error(environment) naming the EGL call or the extension that is missing
  EglContext(EGLDisplay display, bool debug);
  explicit EglContext(const Borrowed& borrowed);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Every public call of the backend starts with this, so several contexts can take turns in one thread.
  void make_current() const;

  /// Makes the context current to free an object of it. False: it cannot, and the object is left behind.
  [[nodiscard]] bool can_free() const noexcept;

 private:
  void check_extensions() const;

  EGLDisplay display_;
  EGLSurface surface_ = EGL_NO_SURFACE;
  EGLContext context_;
  bool is_own_ = true;
};

}  // namespace reliefbench
