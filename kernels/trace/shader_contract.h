#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

class Settings;
struct Technique;

// What C++ and the shaders must agree on, from one definition: the rows and constants of C++, as GLSL.

/// The value of a specialization constant.
struct SpecConstant {
  std::uint32_t id;
  std::int32_t value;
};

// Samplers of the shaders, by name.
inline constexpr const char* kReliefMap = "relief_map";
inline constexpr const char* kNormalMap = "normal_map";
inline constexpr const char* kReferenceMap = "reference_map";
inline constexpr const char* kExtraMap = "extra_map";
/// Where a sampler's texture is bound in both APIs.
[[nodiscard]] int binding_of(std::string_view sampler);

/// GLSL for every trace and frame: samplers, named choices, shared specialization constants with their defaults,
/// statuses of a hit, and the numbers that encodings and maps are made with. The shaders include it as contract.glsl.
[[nodiscard]] std::string shared_contract();

/// GLSL of a technique's own run-time parameters: named choices, and a specialization constant with the row's default
/// for each. The shaders include it as parameters.glsl, before the technique's own file.
[[nodiscard]] std::string parameters_contract(const Technique& technique);

/// What the shared constants and those of a technique are set to.
/// settings: null for a shader that is no technique's
[[nodiscard]] std::vector<SpecConstant> constants_of(const Settings* settings, Wrap wrap);

}  // namespace reliefbench
