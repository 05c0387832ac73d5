#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

using Spirv = std::vector<std::uint32_t>;

/// The last stage of a fragment shader: `shade.frag` or `score.frag` include the technique's trace.
/// technique: a shader file's name without `.glsl`, included by the stage as "technique.glsl"
/// throws: Error(environment) with the file, line and message of glslang
[[nodiscard]] Spirv compile_fragment(std::string_view technique, Target target, Dialect dialect);

/// A trace's text that is not one of the binary's own (a user's technique, a test's probe).
struct TechniqueSource {
  std::string name;       ///< as errors show it
  std::string_view text;  ///< GLSL that defines `Hit trace(Ray)`
};
[[nodiscard]] Spirv compile_fragment(const TechniqueSource& technique, Target target, Dialect dialect);

/// A whole fragment shader that is not one of the binary's own; it may include those.
[[nodiscard]] Spirv compile_whole_fragment(const TechniqueSource& shader, Dialect dialect);

/// The full-screen triangle.
[[nodiscard]] Spirv compile_vertex(Dialect dialect);

/// A compute shader of the binary's own.
/// name: a shader file's name without `.comp`
/// throws: Error(environment) where there is no such file
[[nodiscard]] Spirv compile_compute(std::string_view name, Dialect dialect);

/// The audit's and the control case's load: `load.frag`, an arithmetic loop whose length is constant 0. Target::color
[[nodiscard]] Spirv compile_load(Dialect dialect);

}  // namespace reliefbench
