#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "kernels/image/heightfield.h"

namespace reliefbench {

/// A grey picture of a size x size heightmap that a seed tells from others; neither 0 nor 255 stands in it.
inline void write_heightmap(const std::filesystem::path& path, std::uint32_t seed, int size = 16) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << size << " " << size << "\n255\n";
  std::uint32_t state = seed * 2654435761U + 1;
  for (int i = 0; i < size * size; ++i) {
    state = state * 1664525U + 1013904223U;
    out.put(static_cast<char>(20 + (state >> 24U) % 200));
  }
}

/// A relief as a solid that stands on the bottom plate.
inline Heightfield on_the_bottom(Heightfield heights) {
  heights.floors.assign(heights.texels.size(), 0.0F);
  return heights;
}

}  // namespace reliefbench
