#include "kernels/image/heightmap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

#include "kernels/base/error.h"
#include "kernels/image/image.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

constexpr std::array kKnown{
    KnownHeightmapRow{.id = "rocks",
                      .file = "rocks_NM_height.tga",
                      .channel = "a",
                      .normalise = false,
                      .origin = "Debian package efl-doc (EFL examples, BSD-2-clause)"},
    KnownHeightmapRow{.id = "four",
                      .file = "four_NM_height.tga",
                      .channel = "a",
                      .normalise = false,
                      .origin = "Debian package efl-doc (EFL examples, BSD-2-clause)"},
    KnownHeightmapRow{.id = "jacksboro",
                      .file = "jacksboro.pgm",
                      .channel = "r",
                      .normalise = true,
                      .origin = "Debian package python-matplotlib-data (USGS elevation model, public domain)"},
};

constexpr std::array<std::string_view, 6> kChannels{"auto", "r", "g", "b", "a", "luminance"};

template <typename Rows>
const typename Rows::value_type* find_row(const Rows& rows, std::string_view id) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& candidate) { return candidate.id == id; });
  return row == rows.end() ? nullptr : &*row;
}

template <typename Rows>
std::string ids(const Rows& rows) {
  std::string text;
  for (const auto& row : rows) text += (text.empty() ? "" : ", ") + std::string(row.id);
  return text;
}

/// One channel of an image, or the luminance of its first three.
std::vector<float> channel_values(const Image& image, int first, bool luminance) {
  const std::size_t stride = image.channels.size();
  std::vector<float> values(image.pixels.size() / stride);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float* pixel = &image.pixels[i * stride + static_cast<std::size_t>(first)];
    // Rec. 709 weights on the stored values: heights carry no transfer function.
    values[i] = luminance ? static_cast<float>(0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2]) : *pixel;
  }
  return values;
}

/// Colour channels in front of alpha: 3 for RGB, else how many there are up to 2.
int colours(const Image& image) {
  const int count = static_cast<int>(image.channels.size());
  return std::min(3, image.alpha >= 0 ? image.alpha : count);
}

bool colours_differ(const Image& image) {
  const std::size_t stride = image.channels.size();
  for (std::size_t i = 0; i < image.pixels.size(); i += stride)
    if (image.pixels[i] != image.pixels[i + 1] || image.pixels[i] != image.pixels[i + 2]) return true;
  return false;
}

std::vector<float> select_channel(const Image& image, std::string_view channel, const std::string& name) {
  const bool has_rgb = colours(image) == 3;
  if (channel == "auto") {
    if (image.alpha >= 0) {
      std::vector<float> alpha = channel_values(image, image.alpha, false);
      if (std::any_of(alpha.begin(), alpha.end(), [&](float a) { return a != alpha[0]; })) return alpha;
    }
    return channel_values(image, 0, has_rgb && colours_differ(image));
  }
  if (channel == "luminance") return channel_values(image, 0, has_rgb);
  if (channel == "a" && image.alpha >= 0) return channel_values(image, image.alpha, false);
  const auto index = static_cast<int>(std::string_view("rgb").find(channel));
  if (channel == "a" || index >= colours(image))
    fail_input("{}: has no channel '{}'; its channels are {}", name, channel, fmt::join(image.channels, ", "));
  return channel_values(image, index, false);
}

void check_finite(const Heightfield& heights, const std::string& name) {
  const auto bad =
      std::find_if_not(heights.texels.begin(), heights.texels.end(), [](float h) { return std::isfinite(h); });
  if (bad == heights.texels.end()) return;
  const auto i = bad - heights.texels.begin();
  fail_input("{}: the pixel at ({}, {}) is {}; heights must be finite", name, i % heights.width, i / heights.width,
             *bad);
}

void check_range(const Heightfield& heights, const std::string& name) {
  const auto bad = std::find_if(heights.texels.begin(), heights.texels.end(), [](float h) { return h < 0 || h > 1; });
  if (bad == heights.texels.end()) return;
  const auto i = bad - heights.texels.begin();
  fail_input("{}: the pixel at ({}, {}) is {}; heights must lie in [0, 1] (set normalise to stretch them)", name,
             i % heights.width, i / heights.width, *bad);
}

void stretch(std::vector<float>& texels) {
  const auto [low, high] = std::minmax_element(texels.begin(), texels.end());
  const double base = *low;
  const double range = *high - base;
  for (float& texel : texels) texel = range > 0 ? static_cast<float>((texel - base) / range) : 0.0F;
}

Heightfield read_heightmap(const fs::path& path, std::string_view channel, bool normalise) {
  const std::string name = path.string();
  const Image image = load_image(path);
  Heightfield heights{.width = image.width, .height = image.height, .texels = select_channel(image, channel, name)};
  check_finite(heights, name);
  if (normalise) stretch(heights.texels);
  check_range(heights, name);
  return heights;
}

fs::path find_known(const KnownHeightmapRow& row) {
  std::string searched;
  std::error_code ignored;
  for (const fs::path& folder : heightmap_folders()) {
    if (fs::exists(folder / row.file, ignored)) return folder / row.file;
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  fail_input("heightmap '{}': {} is in none of {}; run `./dev setup`", row.id, row.file, searched);
}

Heightfield generate(const ProceduralRow& row, const HeightmapSpec& spec) {
  for (const int side : {spec.width, spec.height})
    if (side < 2 || side > kMaxSide)
      fail_input("heightmap '{}': a size of {}x{} is not possible; each side must be 2 to {} texels", row.id,
                 spec.width, spec.height, kMaxSide);
  return row.generate(spec.width, spec.height, spec.seed);
}

Heightfield resolve(const HeightmapSpec& spec) {
  if (const ProceduralRow* row = find_row(procedurals(), spec.source)) {
    Heightfield heights = generate(*row, spec);
    if (spec.normalise) stretch(heights.texels);
    return heights;
  }
  if (const KnownHeightmapRow* row = find_row(known_heightmaps(), spec.source))
    return read_heightmap(find_known(*row), spec.channel == "auto" ? row->channel : spec.channel,
                          spec.normalise || row->normalise);
  std::error_code ignored;
  if (!fs::exists(spec.source, ignored))
    fail_input("heightmap '{}': no such file; the known names are {}, {}", spec.source, ids(known_heightmaps()),
               ids(procedurals()));
  return read_heightmap(spec.source, spec.channel, spec.normalise);
}

}  // namespace

std::span<const KnownHeightmapRow> known_heightmaps() { return kKnown; }

std::vector<fs::path> heightmap_folders() {
  if (const char* chosen = std::getenv("RELIEFBENCH_HEIGHTMAPS"); chosen != nullptr && *chosen != '\0') return {chosen};
  std::vector<fs::path> folders{"build/heightmaps"};
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(executable.parent_path().parent_path() / "heightmaps");
  return folders;
}

Heightfield load_heightmap(const HeightmapSpec& spec) {
  if (std::find(kChannels.begin(), kChannels.end(), spec.channel) == kChannels.end())
    fail_input("heightmap '{}': unknown channel '{}'; the choices are {}", spec.source, spec.channel,
               fmt::join(kChannels, ", "));
  Heightfield heights = resolve(spec);
  if (spec.invert)
    for (float& texel : heights.texels) texel = 1.0F - texel;
  return heights;
}

}  // namespace reliefbench
