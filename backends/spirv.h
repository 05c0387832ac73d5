#pragma once
#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// The first word of a SPIR-V module in this machine's byte order.
inline constexpr std::uint32_t kSpirvMagic = 0x07230203;

/// A specialization constant of a SPIR-V module.
struct DeclaredConstant {
  std::uint32_t id;  ///< constant_id in GLSL
  std::string name;  ///< "" where the names were stripped
};

/// A variable of a shader's interface.
struct ShaderVariable {
  std::string name;         ///< of a sampler, an image or an output; of a uniform block its type's
  std::uint32_t place = 0;  ///< binding in descriptor set 0; of an output its location
  bool operator==(const ShaderVariable&) const = default;
};

/// What a module wants from outside and gives to it, in the order of their places. Samplers, images and uniform blocks
/// count only where the module's code reads them: a declaration alone binds nothing.
struct ShaderInterface {
  std::vector<DeclaredConstant> constants;  ///< in the module's order; OpenGL refuses any other id
  std::vector<ShaderVariable> samplers;
  std::vector<ShaderVariable> uniform_blocks;
  std::vector<ShaderVariable> outputs;   ///< of a fragment shader: colors
  std::vector<ShaderVariable> images;    ///< that are written to, by name and binding
  std::array<std::uint32_t, 3> group{};  ///< invocations of a compute shader's group along each axis
};

/// throws: Error(environment): not a SPIR-V module of this machine's byte order, cut short, or with resources in
/// another descriptor set than 0
[[nodiscard]] ShaderInterface reflect(std::span<const std::uint32_t> spirv);

/// How a compute shader sees a buffer.
enum class BufferView {
  storage,  ///< as it lies there
  block,    ///< constants (std140)
  texels,   ///< of four floats
};
inline constexpr std::size_t kBufferTexelBytes = 4 * sizeof(float);
/// Of what is bound at 0, 1, ... in descriptor set 0, as the shader declares it; storage where it reads nothing there.
/// throws: as reflect does, and Error(environment): a binding beyond `count`
[[nodiscard]] std::vector<BufferView> buffer_views(std::span<const std::uint32_t> spirv, int count);

/// The same module with functions named as their source has them, without the types of their parameters.
[[nodiscard]] std::vector<std::uint32_t> with_plain_names(std::span<const std::uint32_t> spirv);

/// Of how many components the floored remainders are that the module computes (GLSL's mod): 1 to 4.
[[nodiscard]] std::set<std::uint32_t> remainder_widths(std::span<const std::uint32_t> spirv);

/// The interface of both stages of a pipeline: the resources of either, the fragment shader's outputs.
/// throws: Error(environment): the stages put different things at one binding
[[nodiscard]] ShaderInterface joined(const ShaderInterface& vertex, const ShaderInterface& fragment);

}  // namespace reliefbench
