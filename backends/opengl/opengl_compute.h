#pragma once
#include <string>

#include "backends/opengl/opengl_objects.h"

namespace reliefbench {

/// A compute shader.
class OpenglCompute final : public Pipeline {
 public:
  OpenglCompute(const EglContext& context, const ComputeDesc& desc);

  [[nodiscard]] const std::string& label() const { return label_; }
  [[nodiscard]] std::size_t buffers() const { return buffers_; }
  [[nodiscard]] GLuint program() const { return program_.id(); }

 private:
  std::string label_;
  std::size_t buffers_;
  OpenglProgram program_;
};

/// Backend::compute, on the current context.
[[nodiscard]] ComputeResult run_compute(const EglContext& context, const ComputeJob& job);

}  // namespace reliefbench
