#include "kernels/maps/map_file.h"

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/image/encode_image.h"
#include "kernels/image/ktx2.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using Metadata = std::map<std::string, std::string>;

/// "x.png" to "x.extra.png"
fs::path extra_path(fs::path path) {
  const std::string extension = path.extension().string();
  return path.replace_extension(".extra" + extension);
}

std::string png(const TextureImage& image, const Metadata& metadata) {
  const std::vector<std::string> names = image.layout.channels == 1   ? std::vector<std::string>{"Y"}
                                         : image.layout.channels == 2 ? std::vector<std::string>{"Y", "A"}
                                                                      : std::vector<std::string>{"R", "G", "B", "A"};
  return encode_png({.width = image.width,
                     .height = image.height,
                     .type = image.layout.type,
                     .channels = names,
                     .pixels = image.texels,
                     .metadata = metadata});
}

std::string exr(const MapStorage& storage, const MapTextures& textures, const Metadata& metadata) {
  const bool is_solid = storage.map.is_solid;
  const UnpackedMap map = unpack_map(textures, storage.format, storage.encoding, is_solid);
  const auto ratios = static_cast<std::size_t>(storage.map.ratios);
  const auto stored_ratios = static_cast<std::size_t>(storage.format.ratios() - (is_solid ? 1 : 0));
  std::vector<std::string> names{"H"};
  if (is_solid) names.emplace_back("F");
  for (std::size_t k = 0; k < ratios; ++k) names.push_back(k == 0 ? "C" : fmt::format("C{}", k + 1));
  std::vector<float> pixels;
  pixels.reserve(map.heights.texels.size() * names.size());
  for (std::size_t i = 0; i < map.heights.texels.size(); ++i) {
    pixels.push_back(map.heights.texels[i]);
    if (is_solid) pixels.push_back(map.heights.floors[i]);
    for (std::size_t k = 0; k < ratios; ++k) pixels.push_back(map.ratios[i * stored_ratios + k]);
  }
  return encode_exr({.width = map.heights.width,
                     .height = map.heights.height,
                     .type = TexelType::float32,
                     .channels = names,
                     .pixels = std::as_bytes(std::span(pixels)),
                     .metadata = metadata});
}

}  // namespace

std::string file_conflict(const fs::path& path, const MapStorage& storage) {
  const std::string extension = path.extension().string();
  const bool is_flat = storage.map.content == MapContent::heights || storage.map.content == MapContent::ratios;
  if (extension == ".ktx2") return "";
  if (extension != ".png" && extension != ".exr")
    return fmt::format("{}: a map is written as .ktx2, .exr or .png", path.string());
  if (!is_flat) return fmt::format("{}: a {} map is written as .ktx2 only", path.string(), storage.map.id);
  const TexelType type = storage.format.type;
  if (extension == ".png" && (is_float(type) || is_of_blocks(type)))
    return fmt::format("{}: a PNG cannot hold the {} of {}; write .ktx2 or .exr", path.string(),
                       is_float(type) ? "floats" : "blocks", storage.format.id);
  return "";
}

std::vector<fs::path> write_map(const fs::path& path, const MapStorage& storage, const MapTextures& textures,
                                const Metadata& metadata) {
  if (const std::string reason = file_conflict(path, storage); !reason.empty()) fail_input("{}", reason);
  if (path.extension() == ".exr") {
    write_output(path, exr(storage, textures, metadata));
    return {path};
  }
  const auto write = [&](const fs::path& file, const TextureImage& image) {
    write_output(
        file, path.extension() == ".png" ? png(image, metadata) : encode_ktx2({.image = image, .metadata = metadata}));
  };
  std::vector<fs::path> files{path};
  write(path, textures.relief);
  if (textures.extra) {
    files.push_back(extra_path(path));
    write(files.back(), *textures.extra);
  }
  return files;
}

}  // namespace reliefbench
