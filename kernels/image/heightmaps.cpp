#include "kernels/image/heightmaps.h"

#include <fmt/format.h>

#include "kernels/base/sha256.h"

namespace reliefbench {

std::string heights_sha256(const Heightfield& heights) {
  std::string text =
      fmt::format("{}x{} {}", heights.width, heights.height, sha256(std::as_bytes(std::span(heights.texels))));
  if (heights.is_solid()) text += fmt::format(" floors {}", sha256(std::as_bytes(std::span(heights.floors))));
  return sha256(text);
}

const LoadedHeights& Heightmaps::read(const HeightmapSpec& spec) {
  const std::string key = fmt::format("{}|{}|{}|{}|{}x{}|{}|{}", spec.channel, spec.floor, spec.invert, spec.normalise,
                                      spec.width, spec.height, spec.seed, spec.source);
  if (const auto found = read_.find(key); found != read_.end()) return found->second;
  LoadedHeights loaded{};
  loaded.field = load_heightmap(spec, &loaded.reading);
  loaded.sha256 = heights_sha256(loaded.field);
  return read_.emplace(key, std::move(loaded)).first->second;
}

std::vector<std::string> Heightmaps::readings() const {
  std::vector<std::string> texts;
  for (const auto& [key, loaded] : read_)
    if (!loaded.reading.empty()) texts.push_back(loaded.reading);
  return texts;
}

}  // namespace reliefbench
