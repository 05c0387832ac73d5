#pragma once
#include <map>
#include <string>
#include <vector>

#include "kernels/image/heightmap.h"

namespace reliefbench {

/// SHA-256 of a heightmap's sides and texels: equal for equal heights, whatever file they came from.
[[nodiscard]] std::string heights_sha256(const Heightfield& heights);

/// A heightmap as it was read: channel chosen, normalised, inverted.
struct LoadedHeights {
  Heightfield field;
  std::string sha256;   ///< heights_sha256()
  std::string reading;  ///< what was read of the file (load_heightmap); "" of a procedural one
};

/// Heightmaps, each read once: a file that changes while a process runs is, for that process, what it was at first.
class Heightmaps {
 public:
  /// Valid while this lives, also after it is moved. throws: as load_heightmap()
  const LoadedHeights& read(const HeightmapSpec& spec);
  /// LoadedHeights::reading of all files that were read.
  [[nodiscard]] std::vector<std::string> readings() const;

 private:
  std::map<std::string, LoadedHeights> read_;  // by the spec's fields
};

}  // namespace reliefbench
