#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "kernels/maps/map_storage.h"
#include "kernels/maps/map_texture.h"

namespace reliefbench {

/// Why a map cannot be written to such a file, or "" if it can. .ktx2 holds every map as it is, the extra texture in a
/// file of its own (x.extra.ktx2); .png the same without mip levels or floats; .exr heights and ratios decoded, as
/// float channels H, C, C2 to C4, and F for the floors of a solid.
[[nodiscard]] std::string file_conflict(const std::filesystem::path& path, const MapStorage& storage);

/// Writes a map; each file whole or not at all. metadata: goes into every file
/// returns: the files' paths. throws: Error(bad_input): unwritable, or file_conflict() has a reason
std::vector<std::filesystem::path> write_map(const std::filesystem::path& path, const MapStorage& storage,
                                             const MapTextures& textures,
                                             const std::map<std::string, std::string>& metadata);

}  // namespace reliefbench
