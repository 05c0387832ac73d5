#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/image/heightfield.h"
#include "kernels/trace/feature.h"

namespace reliefbench {

class Settings;
enum class SurfaceKind;
struct Technique;

// What C++ and the shaders must agree on, from one definition: the rows and constants of C++, as GLSL.

/// The value of a specialization constant.
struct SpecConstant {
  std::uint32_t id;
  std::int32_t value;
};

/// What a sampler's linear filter may be off by, for one type of texel.
struct FilterError {
  double shift = 0;  ///< texels along each axis: it reads the surface that far beside the point that it is asked for
  double value = 0;  ///< and is off that surface by so much, however alike the texels are
};
/// Weights of few bits that shaders compute in the sampler's place: a coarse sampler, on any device.
struct SimulatedFilter {
  int bits = 0;        ///< 0: none, it is the device's own sampler
  bool rounds = true;  ///< to the nearest weight; else towards the first texel
};
/// "6 bits, truncated"
[[nodiscard]] std::string filter_text(const SimulatedFilter& simulated);

/// How a trace with filter=hardware reads its map.
struct MapSampler {
  FilterError error{};
  SimulatedFilter simulated{};
};

// Samplers of the shaders, by name.
inline constexpr const char* kReliefMap = "relief_map";
inline constexpr const char* kNormalMap = "normal_map";
inline constexpr const char* kReferenceMap = "reference_map";
inline constexpr const char* kExtraMap = "extra_map";
inline constexpr const char* kMeshMap = "mesh_map";
/// Where a sampler's texture is bound in both APIs.
[[nodiscard]] int binding_of(std::string_view sampler);

/// GLSL for every trace and frame: samplers, named choices, shared specialization constants with their defaults,
/// statuses of a hit, and the numbers that encodings and maps are made with. The shaders include it as contract.glsl.
[[nodiscard]] std::string shared_contract();

/// GLSL of a technique's own run-time parameters: named choices, and a specialization constant with the row's default
/// for each. The shaders include it as parameters.glsl, before the technique's own file.
[[nodiscard]] std::string parameters_contract(const Technique& technique);

/// Shader files that others stand for in a technique's text: name, text. How its map keeps cones says which file is
/// included as cone_sample.glsl, whether it has floors which one as gap.glsl.
[[nodiscard]] std::map<std::string, std::string> stand_ins(const Technique& technique);

/// GLSL of the constants of features' chosen rows.
[[nodiscard]] std::string feature_parameters(std::span<const PixelFeature> features);
/// GLSL in place of frame.glsl of a frame on a curved surface: what the chosen silhouette defines.
/// has_exact_hits: it shades those of the reference
[[nodiscard]] std::string frame_contract(std::span<const PixelFeature> features, SurfaceKind surface,
                                         bool has_exact_hits);
/// GLSL of how a mesh lies in its image (mesh_texels), for shaders that read it.
[[nodiscard]] std::string mesh_contract();
/// GLSL of the features of the scene that a frame has: the constants of their chosen rows, the rows' files, and
/// `PixelValues values_of(Ray ray, inout Hit hit)` and `void shade(PixelValues values, inout Shading shading)` over all
/// of them. Both last stages include it as features.glsl; "" without features, so that nothing is added to their text.
[[nodiscard]] std::string features_contract(std::span<const PixelFeature> features);
/// GLSL of the score frame's outputs for them (PixelValue::output), and `void put(PixelValues values)`
/// and `void put_nothing()`, of a pixel without a ray.
[[nodiscard]] std::string feature_outputs(std::span<const PixelFeature> features);

/// What the shared constants and those of a technique are set to.
/// settings: null for a shader that is no technique's
/// sampler: what it may be off by is what settings that read with it, and guarantee something, make up for
[[nodiscard]] std::vector<SpecConstant> constants_of(const Settings* settings, Wrap wrap,
                                                     const MapSampler& sampler = {});

}  // namespace reliefbench
