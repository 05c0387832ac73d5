#include "backends/opengl/egl.h"

#include <dlfcn.h>
#include <epoxy/gl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

[[noreturn]] void fail_egl(const char* call) {
  const EGLint error = eglGetError();
  fail_device(fault_of_egl(error), "EGL: {} failed (0x{:04x})", call, error);
}

/// A machine may have EGL and not OpenGL's own library: libepoxy ends the process there at the first call of OpenGL.
bool has_opengl_library() {
  for (const char* name : {"libOpenGL.so.0", "libGL.so.1"})
    if (void* library = dlopen(name, RTLD_LAZY)) {
      dlclose(library);
      return true;
    }
  return false;
}

std::vector<EGLDeviceEXT> enumerated_devices() {
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) return {};
  // EGL_EXT_device_base is the older name of enumeration and query together.
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base"))
    return {};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(0, nullptr, &count) || count <= 0) return {};
  std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
  if (!eglQueryDevicesEXT(count, devices.data(), &count)) return {};
  devices.resize(static_cast<std::size_t>(count));
  return devices;
}

/// EGL_NO_DISPLAY where it cannot be opened.
EGLDisplay initialised(EGLenum platform, void* native) {
  EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) return EGL_NO_DISPLAY;
  return display;
}

/// The device behind a display; none where EGL does not tell.
EGLDeviceEXT device_of(EGLDisplay display) {
  EGLAttrib device = 0;
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_query") &&
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base"))
    return EGL_NO_DEVICE_EXT;
  if (!eglQueryDisplayAttribEXT(display, EGL_DEVICE_EXT, &device)) return EGL_NO_DEVICE_EXT;
  return reinterpret_cast<EGLDeviceEXT>(device);  // NOLINT(performance-no-int-to-ptr): EGL's own way to return it
}

EGLContext create_context(EGLDisplay display, bool debug) {
  for (const char* extension : {"EGL_KHR_create_context", "EGL_KHR_surfaceless_context", "EGL_KHR_no_config_context"})
    if (!epoxy_has_egl_extension(display, extension)) fail_environment("EGL: {} is missing", extension);
  if (!eglBindAPI(EGL_OPENGL_API)) fail_egl("eglBindAPI");
  std::vector<EGLint> attributes = {EGL_CONTEXT_MAJOR_VERSION_KHR,
                                    4,
                                    EGL_CONTEXT_MINOR_VERSION_KHR,
                                    5,
                                    EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                    EGL_CONTEXT_FLAGS_KHR,
                                    debug ? EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR : 0,
                                    EGL_NONE};
  // A context that tells of the loss of its device, where the driver has such.
  std::vector<EGLint> telling = attributes;
  telling.insert(telling.end() - 1,
                 {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY_KHR, EGL_LOSE_CONTEXT_ON_RESET_KHR});
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, telling.data());
  if (context == EGL_NO_CONTEXT)
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
  if (context == EGL_NO_CONTEXT) fail_egl("eglCreateContext for OpenGL 4.5 core");
  return context;
}

void destroy(EGLDisplay display, EGLContext context) {
  if (eglGetCurrentContext() == context) eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display, context);
}

}  // namespace

Fault fault_of_egl(EGLint error) {
  if (error == EGL_CONTEXT_LOST) return Fault::device_lost;
  return error == EGL_BAD_ALLOC ? Fault::out_of_memory : Fault::other;
}

std::vector<EGLDisplay> egl_displays() {
  // Mesa writes to stderr about every device that another vendor's driver owns, unless it is told otherwise.
  setenv("EGL_LOG_LEVEL", "fatal", 0);
  if (!epoxy_has_egl() || !has_opengl_library()) return {};
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) return {};

  std::vector<EGLDisplay> displays;
  std::vector<EGLDeviceEXT> opened;
  for (EGLDeviceEXT device : enumerated_devices())
    if (EGLDisplay display = initialised(EGL_PLATFORM_DEVICE_EXT, device)) {
      displays.push_back(display);
      opened.push_back(device);
    }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
    if (EGLDisplay display = initialised(EGL_PLATFORM_SURFACELESS_MESA, nullptr))
      if (std::find(opened.begin(), opened.end(), device_of(display)) == opened.end()) displays.push_back(display);
  return displays;
}

std::string pci_address(EGLDisplay display) {
  EGLDeviceEXT const device = device_of(display);
  if (device == EGL_NO_DEVICE_EXT) return "";
  const char* const extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
  if (extensions == nullptr || !epoxy_extension_in_string(extensions, "EGL_EXT_device_drm")) return "";
  const char* const file = eglQueryDeviceStringEXT(device, EGL_DRM_DEVICE_FILE_EXT);
  struct stat status {};
  if (file == nullptr || ::stat(file, &status) != 0 || !S_ISCHR(status.st_mode)) return "";
  std::error_code error;
  const std::filesystem::path link =
      fmt::format("/sys/dev/char/{}:{}/device", major(status.st_rdev), minor(status.st_rdev));
  const std::filesystem::path folder = std::filesystem::canonical(link, error);
  const bool is_pci = std::filesystem::exists("/sys/bus/pci/devices" / folder.filename(), error);
  return is_pci && !folder.empty() ? folder.filename().string() : "";
}

EglContext::EglContext(EGLDisplay display, bool debug) : display_(display), context_(create_context(display, debug)) {
  try {
    check_extensions();
  } catch (const Error&) {
    destroy(display_, context_);
    throw;
  }
}

EglContext::EglContext(const Borrowed& borrowed)
    : display_(borrowed.display), surface_(borrowed.surface), context_(borrowed.context), is_own_(false) {
  check_extensions();
}

EglContext::~EglContext() {
  if (is_own_) destroy(display_, context_);
}

void EglContext::check_extensions() const {
  make_current();
  if (!epoxy_has_gl_extension("GL_ARB_gl_spirv"))
    fail_environment("OpenGL: {} lacks GL_ARB_gl_spirv", reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
}

bool EglContext::can_free() const noexcept {
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return false;
  return eglGetCurrentContext() == context_ || eglMakeCurrent(display_, surface_, surface_, context_) == EGL_TRUE;
}

void EglContext::make_current() const {
  if (!eglBindAPI(EGL_OPENGL_API)) fail_egl("eglBindAPI");
  if (eglGetCurrentContext() == context_) return;
  if (!eglMakeCurrent(display_, surface_, surface_, context_)) fail_egl("eglMakeCurrent");
}

}  // namespace reliefbench
