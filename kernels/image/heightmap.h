#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// Where a heightmap comes from and how it is read.
struct HeightmapSpec {
  std::string source;  ///< procedural name (`fbm`), known name (`rocks`), or an image file's path, in this order
  std::string channel = "auto";  ///< auto | r | g | b | a | luminance; images only
  bool invert = false;           ///< h -> 1 - h (for depth maps), last
  bool normalise = false;        ///< stretch to the full [0,1]; a constant map becomes 0
  int width = 256;               ///< texels; procedural sources only
  int height = 256;              ///< texels; procedural sources only
  std::uint32_t seed = 1;        ///< procedural sources only
  /// Channel of the lower surface's heights, as `channel`, but never auto; "": a relief. Images only
  std::string floor{};
};

/// A procedural heightmap: one row, one function.
struct ProceduralRow {
  std::string_view id;
  std::string_view description;
  Heightfield (*generate)(int width, int height, std::uint32_t seed);
  bool is_solid = false;  ///< it has floors
};
[[nodiscard]] std::span<const ProceduralRow> procedurals();
/// Whether what is read by this has floors.
[[nodiscard]] bool is_solid(const HeightmapSpec& spec);

/// A real heightmap that `./dev setup` fetches; the file lies in a heightmap folder (heightmap_folders()).
struct KnownHeightmapRow {
  std::string_view id;
  std::string_view file;
  std::string_view channel;
  bool normalise;
  std::string_view origin;  ///< package and licence
};
[[nodiscard]] std::span<const KnownHeightmapRow> known_heightmaps();

/// Where known heightmaps are looked for: $RELIEFBENCH_HEIGHTMAPS alone if it is set, else ./build/heightmaps, then
/// ../heightmaps beside the folder of the executable.
[[nodiscard]] std::vector<std::filesystem::path> heightmap_folders();

/// What `channel` may be: auto, r, g, b, a, luminance.
[[nodiscard]] std::span<const std::string_view> heightmap_channels();
/// What `floor` may be: those but auto.
[[nodiscard]] std::span<const std::string_view> floor_channels();

/// Resolves, reads and checks a heightmap. Channel `auto` of a grey image is grey, whatever its alpha; of a colour
/// image it is alpha if that is not constant, else luminance (Rec. 709 weights on the stored values) if R, G and B
/// differ anywhere, else the first channel. Denormals are kept.
/// reading: gets what was read of a file, "rocks.png: 512x512, 16-bit grey (alpha ignored)"; "" of a procedural one
/// throws: Error(bad_input) naming the file and what was expected: missing, truncated or unreadable file, unknown
///         channel, a side under 2 texels or over kMaxSide (image.h), NaN or infinite pixels, heights outside [0,1]
///         unless normalised
[[nodiscard]] Heightfield load_heightmap(const HeightmapSpec& spec, std::string* reading = nullptr);

/// Tangent-space normals of a heightfield for a relief that is `relief_depth` tiles deep, width x height RGBA8
/// (xyz*0.5+0.5, alpha 255), from central differences of the texels. Shading only; never part of a trace.
[[nodiscard]] std::vector<std::uint8_t> normal_map(const Heightfield& heights, Wrap wrap, double relief_depth);
/// Appends the mip levels of an RGBA8 texture down to 1 x 1, each texel the mean of what it covers.
/// returns: how many levels there are then
int append_levels(std::vector<std::uint8_t>& rgba8, int width, int height);

}  // namespace reliefbench
