#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "kernels/heightfield.h"

namespace reliefbench {

/// Where a heightmap comes from and how it is read.
struct HeightmapSpec {
  std::string source;            ///< known name (`rocks`), procedural name (`fbm`), or an image file's path
  std::string channel = "auto";  ///< auto | r | g | b | a | luminance; auto: see load_image
  bool invert = false;           ///< h -> 1 - h (for depth maps)
  bool normalise = false;        ///< stretch to the full [0,1]
  int width = 256;               ///< texels; procedural sources only
  int height = 256;              ///< texels; procedural sources only
  std::uint32_t seed = 1;        ///< procedural sources only
};

/// A procedural heightmap: one row, one function.
struct ProceduralRow {
  std::string_view id;
  std::string_view description;
  Heightfield (*generate)(int width, int height, std::uint32_t seed);
};
[[nodiscard]] std::span<const ProceduralRow> procedurals();

/// A real heightmap that `./dev setup` fetches; the file lies in a heightmap folder (heightmap_folders()).
struct KnownHeightmapRow {
  std::string_view id;
  std::string_view file;
  std::string_view channel;
  bool normalise;
  std::string_view origin;  ///< package and licence
};
[[nodiscard]] std::span<const KnownHeightmapRow> known_heightmaps();

/// Resolves, reads and checks a heightmap.
/// throws: Error(bad_input) naming the file and what was expected: missing, truncated or unreadable file, unknown
///         channel, a side under 2 texels, NaN or infinite pixels; denormals are kept
[[nodiscard]] Heightfield load_heightmap(const HeightmapSpec& spec);

/// Tangent-space normals of a heightfield for a relief that is `relief_depth` tiles deep, width x height RGBA8
/// (xyz*0.5+0.5, alpha 255), from central differences of the texels. Shading only; never part of a trace.
[[nodiscard]] std::vector<std::uint8_t> normal_map(const Heightfield& heights, Wrap wrap, double relief_depth);

}  // namespace reliefbench
