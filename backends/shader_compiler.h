#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

using Spirv = std::vector<std::uint32_t>;

/// GLSL that is not one of the binary's files: generated, a user's, a test's.
struct ShaderText {
  std::string name;  ///< as errors show it and #include finds it
  std::string text;
};

/// What puts a frame's pixels: `shade.glsl` or `score.glsl` with the technique's trace, as a fragment shader or, where
/// the target is by_compute, as a compute shader.
/// technique: a shader file's name without `.glsl`, included by the stage as "technique.glsl", after the constants of
/// its row where there is one
/// features: of the scene, that the frame has; without any the text is the same as if there were none to have
/// throws: Error(environment) with the file, line and message of glslang
/// surface: that the relief lies on
[[nodiscard]] Spirv compile_fragment(std::string_view technique, const Target& target, Dialect dialect,
                                     std::span<const PixelFeature> features = {},
                                     SurfaceKind surface = SurfaceKind::plane);
/// technique: defines `Hit trace(Ray)`
[[nodiscard]] Spirv compile_fragment(const ShaderText& technique, const Target& target, Dialect dialect);

/// A whole fragment shader that is not one of the binary's own; it may include those.
[[nodiscard]] Spirv compile_whole_fragment(const ShaderText& shader, Dialect dialect);

/// A vertex shader of the binary's own: the full-screen triangle at depth 0 ("fullscreen") or at the top plate's depth
/// ("plate"), a rectangle before the eye ("occluder"), or the triangles of a mesh ("mesh").
[[nodiscard]] Spirv compile_vertex(Dialect dialect, std::string_view name = "fullscreen");

/// A fragment shader of the binary's own that is no trace's: what frames hold beside the relief.
/// name: a shader file's name without `.frag`
[[nodiscard]] Spirv compile_beside(std::string_view name, Dialect dialect);

/// Dear ImGui's triangles in a window: `panel.vert` and `panel.frag`.
enum class PanelStage { vertex, fragment };
[[nodiscard]] Spirv compile_panel(PanelStage stage, Dialect dialect);

/// A compute shader of the binary's own.
/// name: a shader file's name without `.comp`; contract: what it includes beside the binary's files
/// throws: Error(environment) where there is no such file
[[nodiscard]] Spirv compile_compute(std::string_view name, Dialect dialect, const ShaderText& contract);

/// The audit's and the control case's load: `load.glsl`, an arithmetic loop whose length is constant 0. Into
/// Target::color, or that by compute.
[[nodiscard]] Spirv compile_load(Dialect dialect, bool by_compute = false);

/// The filter audit's enlarged texels: `filter.frag`. Into an attachment "out_shown".
[[nodiscard]] Spirv compile_filter(Dialect dialect);

}  // namespace reliefbench
