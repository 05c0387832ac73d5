#pragma once
#include <string>
#include <vector>

namespace reliefbench {

/// Lines of a shader file as those of straight rays on planes have them, which is all that ships: without what stands
/// under BENT_RAYS or CURVED, and with the macros of ray.glsl written out.
[[nodiscard]] std::vector<std::string> straight_rays(std::vector<std::string> lines);

}  // namespace reliefbench
