#pragma once
#include <span>
#include <string>
#include <vector>

#include "backends/opengl/opengl_objects.h"
#include "backends/spirv.h"

namespace reliefbench {

/// A compute shader.
class OpenglCompute final : public Pipeline {
 public:
  OpenglCompute(const EglContext& context, const ComputeDesc& desc, const PipelineCache& cache);

  [[nodiscard]] const std::string& label() const { return label_; }
  /// How it sees what is bound at 0, 1, ...
  [[nodiscard]] std::span<const BufferView> views() const { return views_; }
  [[nodiscard]] GLuint program() const { return program_.id(); }

 private:
  std::string label_;
  std::vector<BufferView> views_;
  OpenglProgram program_;
};

/// Backend::compute, on the current context.
[[nodiscard]] ComputeResult run_compute(const EglContext& context, const ComputeJob& job);

}  // namespace reliefbench
