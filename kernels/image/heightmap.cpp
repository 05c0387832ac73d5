#include "kernels/image/heightmap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
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
    KnownHeightmapRow{.id = "bathymetry",
                      .file = "bathymetry.pgm",
                      .channel = "r",
                      .normalise = true,
                      .origin = "Debian package python-matplotlib-data (sea floor, matplotlib's licence)"},
    KnownHeightmapRow{.id = "arena",
                      .file = "arena.png",
                      .channel = "r",
                      .normalise = true,
                      .origin = "Debian package colobot-common (a game's terrain, GPL-3)"},
    KnownHeightmapRow{.id = "island",
                      .file = "island.png",
                      .channel = "r",
                      .normalise = true,
                      .origin = "Debian package colobot-common (a game's terrain, GPL-3)"},
};

constexpr std::array<std::string_view, 6> kChannels{"auto", "r", "g", "b", "a", "luminance"};

template <typename Rows>
const typename Rows::value_type* row_or_none(const Rows& rows, std::string_view id) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& candidate) { return candidate.id == id; });
  return row == rows.end() ? nullptr : &*row;
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

/// The channel that heights are taken from, or luminance.
struct ChannelChoice {
  int first = 0;  ///< index of the channel; of luminance, of the first
  bool is_luminance = false;
};

bool is_constant(const std::vector<float>& values) {
  return std::ranges::all_of(values, [&](float value) { return value == values.front(); });
}

ChannelChoice choose_channel(const Image& image, std::string_view channel, const std::string& name) {
  const bool has_rgb = colours(image) == 3;
  if (channel == "auto") {
    if (has_rgb && image.alpha >= 0 && !is_constant(channel_values(image, image.alpha, false)))
      return {.first = image.alpha};
    return {.is_luminance = has_rgb && colours_differ(image)};
  }
  if (channel == "luminance") return {.is_luminance = has_rgb};
  if (channel == "a" && image.alpha >= 0) return {.first = image.alpha};
  const auto index = static_cast<int>(std::string_view("rgb").find(channel));
  if (channel == "a" || index >= colours(image))
    fail_input("{}: has no channel '{}'; its channels are {}", name, channel, fmt::join(image.channels, ", "));
  return {.first = index};
}

/// "512x512, 16-bit grey (alpha ignored)"
/// floor: index of the floor's channel; -1: none
std::string reading_of(const Image& image, const ChannelChoice& choice, int floor) {
  const bool is_grey = colours(image) < 3;
  const bool is_alpha = choice.first == image.alpha;
  std::string taken = "channel " + image.channels[static_cast<std::size_t>(choice.first)];
  if (is_grey && choice.first == 0) taken = "grey";
  if (is_alpha) taken = "alpha";
  if (choice.is_luminance) taken = "luminance";
  std::vector<std::string> ignored;
  for (int i = 0; i < static_cast<int>(image.channels.size()); ++i) {
    const bool is_taken = i == choice.first || i == floor || (choice.is_luminance && i < 3);
    if (!is_taken) ignored.push_back(i == image.alpha ? "alpha" : image.channels[static_cast<std::size_t>(i)]);
  }
  return fmt::format("{}x{}, {} {}{}", image.width, image.height, image.sample, taken,
                     ignored.empty() ? "" : fmt::format(" ({} ignored)", fmt::join(ignored, ", ")));
}

void check_finite(const Heightfield& heights, const std::vector<float>& values, const std::string& name) {
  const auto bad = std::find_if_not(values.begin(), values.end(), [](float h) { return std::isfinite(h); });
  if (bad == values.end()) return;
  const auto i = bad - values.begin();
  fail_input("{}: the pixel at ({}, {}) is {}; heights must be finite", name, i % heights.width, i / heights.width,
             *bad);
}

void check_range(const Heightfield& heights, const std::vector<float>& values, const std::string& name) {
  const auto bad = std::find_if(values.begin(), values.end(), [](float h) { return h < 0 || h > 1; });
  if (bad == values.end()) return;
  const auto i = bad - values.begin();
  fail_input("{}: the pixel at ({}, {}) is {}; heights must lie in [0, 1] (set normalise to stretch them)", name,
             i % heights.width, i / heights.width, *bad);
}

/// The range of both surfaces to [0, 1].
void stretch(Heightfield& heights) {
  const auto [low, high] = std::minmax_element(heights.texels.begin(), heights.texels.end());
  double base = *low;
  double end = *high;
  for (const float floor : heights.floors) {
    base = std::min<double>(base, floor);
    end = std::max<double>(end, floor);
  }
  const double range = end - base;
  for (std::vector<float>* values : {&heights.texels, &heights.floors})
    for (float& height : *values) height = range > 0 ? static_cast<float>((height - base) / range) : 0.0F;
}

struct Channels {
  std::string_view heights;
  std::string_view floors;
};

Heightfield read_heightmap(const fs::path& path, const Channels& channels, bool normalise, std::string& reading) {
  const std::string name = path.string();
  const Image image = load_image(path);
  const ChannelChoice choice = choose_channel(image, channels.heights, name);
  Heightfield heights{
      .width = image.width, .height = image.height, .texels = channel_values(image, choice.first, choice.is_luminance)};
  int floor = -1;
  if (!channels.floors.empty()) {
    const ChannelChoice floors = choose_channel(image, channels.floors, name);
    heights.floors = channel_values(image, floors.first, floors.is_luminance);
    floor = floors.first;
  }
  check_finite(heights, heights.texels, name);
  check_finite(heights, heights.floors, name);
  if (normalise) stretch(heights);
  check_range(heights, heights.texels, name);
  check_range(heights, heights.floors, name);
  reading = fmt::format("{}: {}{}{}", name, reading_of(image, choice, floor),
                        heights.is_solid() ? fmt::format(", floor {}", channels.floors) : "",
                        normalise ? ", normalised" : "");
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

Heightfield resolve(const HeightmapSpec& spec, std::string& reading) {
  if (const ProceduralRow* row = row_or_none(procedurals(), spec.source)) {
    Heightfield heights = generate(*row, spec);
    if (spec.normalise) stretch(heights);
    return heights;
  }
  if (const KnownHeightmapRow* row = row_or_none(known_heightmaps(), spec.source))
    return read_heightmap(find_known(*row), {spec.channel == "auto" ? row->channel : spec.channel, spec.floor},
                          spec.normalise || row->normalise, reading);
  std::error_code ignored;
  if (!fs::exists(spec.source, ignored))
    fail_input("heightmap '{}': no such file; the known names are {}, {}", spec.source,
               fmt::join(ids_of(known_heightmaps()), ", "), fmt::join(ids_of(procedurals()), ", "));
  return read_heightmap(spec.source, {spec.channel, spec.floor}, spec.normalise, reading);
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

bool is_solid(const HeightmapSpec& spec) {
  const ProceduralRow* const row = row_or_none(procedurals(), spec.source);
  return row == nullptr ? !spec.floor.empty() : row->is_solid;
}

std::span<const std::string_view> heightmap_channels() { return kChannels; }
std::span<const std::string_view> floor_channels() { return std::span(kChannels).subspan(1); }

Heightfield load_heightmap(const HeightmapSpec& spec, std::string* reading) {
  if (std::find(kChannels.begin(), kChannels.end(), spec.channel) == kChannels.end())
    fail_input("heightmap '{}': unknown channel '{}'; the choices are {}", spec.source, spec.channel,
               fmt::join(kChannels, ", "));
  if (!spec.floor.empty() && std::ranges::find(floor_channels(), spec.floor) == floor_channels().end())
    fail_input("heightmap '{}': unknown floor channel '{}'; the choices are {}", spec.source, spec.floor,
               fmt::join(floor_channels(), ", "));
  std::string text;
  Heightfield heights = resolve(spec, text);
  if (spec.invert)
    for (std::vector<float>* values : {&heights.texels, &heights.floors})
      for (float& height : *values) height = 1.0F - height;
  if (reading != nullptr) *reading = text.empty() || !spec.invert ? text : text + ", inverted";
  return heights;
}

}  // namespace reliefbench
