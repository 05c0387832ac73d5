#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "backends/opengl/opengl_objects.h"

namespace reliefbench {

/// A compute shader.
class OpenglCompute final : public Pipeline {
 public:
  OpenglCompute(const EglContext& context, const ComputeDesc& desc);
  /// Backend::compute, on the current context
  [[nodiscard]] std::vector<std::byte> run(const ComputeJob& job) const;

 private:
  const EglContext& context_;
  std::string label_;
  int inputs_;
  OpenglProgram program_;
};

}  // namespace reliefbench
