#pragma once
#include <string>

#include "reports/export/shader_pieces.h"

namespace reliefbench {

/// The sampler of all maps, where it is apart from them, and its binding in the examples.
inline constexpr const char* kReliefSampler = "relief_sampler";
inline constexpr int kSamplerBinding = 2;

/// Where in its first step a ray begins (dither.glsl), an argument likewise.
inline constexpr const char* kDitherPhase = "dither_phase";

/// How shaders get their maps.
enum class MapArguments {
  combined,  ///< sampler2D relief_map
  separate,  ///< texture2D relief_map, sampler relief_sampler: WGSL has nothing else
};

/// The maps and what else is a pixel's own as arguments: each function that reads one, itself or through another, gets
/// it as one of its first parameters, and is called with it. So a text binds nothing, and whoever calls it binds as
/// they like.
void pass_maps(Pieces& pieces, MapArguments arguments);

/// A name with the prefix of all that ships: relief_first_hit, ReliefRay, RELIEF_CONE_STEPS.
[[nodiscard]] std::string prefixed_name(const std::string& name);
/// Gives what the needed pieces declare their prefix, in all pieces.
void prefix_names(Pieces& pieces);

/// Breaks lines that are too long after one of their commas.
[[nodiscard]] std::string with_short_lines(const std::string& text);

}  // namespace reliefbench
