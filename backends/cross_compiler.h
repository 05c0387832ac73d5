#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "backends/shader_compiler.h"

namespace reliefbench {

/// A shading language that SPIR-V is written in.
enum class TextLanguage { glsl_es_310, hlsl, msl, wgsl };

/// Vulkan's SPIR-V as text of another language: WGSL by naga, the others by SPIRV-Cross.
/// spirv: of the Vulkan dialect; for WGSL with textures and samplers apart
/// throws: Error(environment): the language cannot say it; for WGSL also that Node.js or naga is not there
[[nodiscard]] std::string cross_compile(const Spirv& spirv, TextLanguage language);

/// Where naga, compiled to WebAssembly, may be (configs/fetch_naga.sh); RELIEFBENCH_NAGA names the only one.
[[nodiscard]] std::vector<std::filesystem::path> naga_folders();
/// naga's WGSL. Runs `node`.
/// throws: Error(environment)
[[nodiscard]] std::string naga_wgsl(const Spirv& spirv);

}  // namespace reliefbench
