#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// A specialization constant of a SPIR-V module.
struct DeclaredConstant {
  std::uint32_t id;  ///< constant_id in GLSL
  std::string name;  ///< "" where the names were stripped
};

/// The specialization constants that a module declares, in the module's order. OpenGL refuses any other id.
/// throws: Error(environment): not a SPIR-V module of this machine's byte order, or cut short
[[nodiscard]] std::vector<DeclaredConstant> declared_constants(std::span<const std::uint32_t> spirv);

}  // namespace reliefbench
