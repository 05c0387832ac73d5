#pragma once
#include <epoxy/gl.h>

#include <memory>
#include <optional>

#include "backends/backend.h"
#include "backends/opengl/egl.h"

namespace reliefbench {

// What a window needs of the backend beside its interface.

/// The backend in a window's context; its device's index is 0. The context must outlive it.
/// throws: Error(environment): it has not what the backend needs
[[nodiscard]] std::unique_ptr<Backend> open_opengl_in(const EglContext::Borrowed& window,
                                                      const BackendOptions& options);

/// The texture of the last frame drawn into Target::color; none of another backend, or where the backend has a context
/// of its own.
[[nodiscard]] std::optional<GLuint> texture_in_window(const Backend& backend);

}  // namespace reliefbench
