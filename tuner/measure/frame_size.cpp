#include "tuner/measure/frame_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>

#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "tuner/plan/config_json.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr const char* kFrameKey = "frame_px";
constexpr std::string_view kOnHardware = "1080p";

std::string choice_text(Size size, std::string_view why) {
  return fmt::format("frames are {}x{} where nothing else is asked for (frame_px, --frame-px), {}", size.width,
                     size.height, why);
}

Size size_of_scene() { return {Scene{}.width_px, Scene{}.height_px}; }

json parsed(const Config& config) { return json::parse(config.text, nullptr, true, /*ignore_comments=*/true); }

/// The config of the run in a folder; null where there is none, or none that can be read: then opening it says so.
json config_in(const std::filesystem::path& folder) {
  std::error_code none;
  if (folder.empty() || !std::filesystem::is_regular_file(folder / kRunFile, none)) return nullptr;
  try {
    json info = read_json(folder / kRunFile);
    return info.is_object() && info.contains("config") ? info["config"] : json(nullptr);
  } catch (const Error&) {
    return nullptr;
  }
}

bool is_side(const json& side) {
  return side.is_number_integer() && side.get<std::int64_t>() >= 1 && side.get<std::int64_t>() <= kFrameSideMax_px;
}

/// What the run that has this config took for the scenes that say nothing in ours; none: Scene's.
std::optional<Size> size_taken(json run_config, const Config& config) {
  json ours = parsed(config);
  const json& own = listed_scenes(ours);
  if (!run_config.is_object() || !run_config.contains("scenes")) return std::nullopt;
  const json& scenes = listed_scenes(run_config);
  for (std::size_t i = 0; i < std::min(own.size(), scenes.size()); ++i) {
    if (own[i].contains(kFrameKey) || !scenes[i].is_object() || !scenes[i].contains(kFrameKey)) continue;
    const json& size = scenes[i][kFrameKey];
    if (size.is_array() && size.size() == 2 && is_side(size[0]) && is_side(size[1]))
      return Size{size[0].get<int>(), size[1].get<int>()};
  }
  return std::nullopt;
}

std::string name_of(const DeviceInfo& device) { return fmt::format("{} ({})", device.name, device.backend); }

/// Changes the text of a config where it holds for a scene.
template <typename Holds>
void write_frames(Config& config, Size size, const Holds& holds) {
  json changed = parsed(config);
  for (json& scene : listed_scenes(changed))
    if (holds(scene)) scene[kFrameKey] = {size.width, size.height};
  config.text = changed.dump(1);
}

}  // namespace

DefaultFrame default_frame(std::span<const DeviceInfo> devices) {
  const FrameSize& large = *find_frame_size(kOnHardware);
  const Size on_hardware{large.width_px, large.height_px};
  const Size own = size_of_scene();
  if (devices.empty())
    return {.why = fmt::format(
                "frames are {}x{} on hardware and {}x{} on software where nothing else is asked for (frame_px, "
                "--frame-px)",
                on_hardware.width, on_hardware.height, own.width, own.height)};
  const auto hardware = std::ranges::find(devices, false, &DeviceInfo::software);
  if (hardware == devices.end()) return {.why = choice_text(own, "since no device is hardware")};
  std::string why = fmt::format("since {} is hardware", name_of(*hardware));
  for (const DeviceInfo& device : devices)
    if (device.software) why += fmt::format("; {} draws the same", name_of(device));
  return {.size_px = on_hardware, .why = choice_text(on_hardware, why)};
}

DefaultFrame default_frame(std::span<const DeviceInfo> devices, const Config& config,
                           const std::filesystem::path& folder) {
  const json run_config = config_in(folder);
  if (run_config.is_null()) return default_frame(devices);
  const std::optional<Size> size = size_taken(run_config, config);
  return {.size_px = size,
          .why = choice_text(size.value_or(size_of_scene()), fmt::format("as when {} was begun", folder.string()))};
}

bool has_default_frames(std::span<const SceneSpec> scenes) {
  return std::ranges::any_of(scenes, &SceneSpec::has_default_frame);
}

void set_frames(std::span<SceneSpec> scenes, Size size_px) {
  for (SceneSpec& scene : scenes) {
    scene.scene.width_px = size_px.width;
    scene.scene.height_px = size_px.height;
    scene.has_default_frame = false;
  }
}

void set_default_frames(std::span<SceneSpec> scenes, const DefaultFrame& frame) {
  if (!frame.size_px) return;
  for (SceneSpec& scene : scenes)
    if (scene.has_default_frame) set_frames({&scene, 1}, *frame.size_px);
}

void set_default_frames(Config& config, const DefaultFrame& frame) {
  if (!frame.size_px) return;
  set_default_frames(config.scenes, frame);
  write_frames(config, *frame.size_px, [](const json& scene) { return !scene.contains(kFrameKey); });
}

void set_frames(Config& config, Size size_px) {
  set_frames(config.scenes, size_px);
  write_frames(config, size_px, [](const json&) { return true; });
}

}  // namespace reliefbench
