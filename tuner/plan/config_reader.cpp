#include "tuner/plan/config_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace reliefbench {
namespace {

constexpr std::array<std::string_view, 8> kConfigKeys{"$schema", "name",  "seed",    "scenes",
                                                      "measure", "front", "budgets", "sweeps"};
constexpr std::array<std::string_view, 12> kSceneKeys{"heightmap", "views",     "relief_depth", "base",
                                                      "tiling",    "pan",       "wrap",         "frame_px",
                                                      "light",     "reference", "occluded",     "surface"};
constexpr std::array<std::string_view, 5> kSurfaceKeys{"kind", "round", "tube", "mesh", "segments"};
constexpr std::array<std::string_view, 4> kPathKeys{"id", "from", "to", "frames"};
constexpr std::array<std::string_view, 9> kHeightmapKeys{"source", "channel", "floor", "invert", "normalise",
                                                         "width",  "height",  "seed",  "name"};
constexpr std::array<std::string_view, 5> kViewKeys{"id", "elevation_deg", "distance", "fov_deg", "azimuth_deg"};
constexpr std::array<std::string_view, 3> kLightKeys{"elevation_deg", "azimuth_deg", "angular_radius_deg"};
constexpr std::array<std::string_view, 7> kMeasureKeys{
    "samples", "batch_ms", "warmup_batches_max", "control_every", "block_cases", "flicker_frames", "timeout_s"};
constexpr std::array<std::string_view, 2> kFrontKeys{"error", "constraints"};
constexpr std::array<std::string_view, 4> kSweepKeys{"technique", "combine", "axes", "where"};
constexpr std::array<std::string_view, 3> kPresetsSweepKeys{"presets", "quality", "device"};
constexpr std::array<std::string_view, 2> kRuleKeys{"if", "then"};
constexpr std::array<std::string_view, 4> kRangeKeys{"from", "to", "times", "step"};

constexpr std::array<ConfigKeys, 13> kObjects{{{.object = "config", .keys = kConfigKeys},
                                               {.object = "scene", .keys = kSceneKeys},
                                               {.object = "heightmap", .keys = kHeightmapKeys},
                                               {.object = "view", .keys = kViewKeys},
                                               {.object = "path", .keys = kPathKeys},
                                               {.object = "light", .keys = kLightKeys},
                                               {.object = "surface", .keys = kSurfaceKeys},
                                               {.object = "measure", .keys = kMeasureKeys},
                                               {.object = "front", .keys = kFrontKeys},
                                               {.object = "sweep", .keys = kSweepKeys},
                                               {.object = "presets_sweep", .keys = kPresetsSweepKeys},
                                               {.object = "rule", .keys = kRuleKeys},
                                               {.object = "range", .keys = kRangeKeys}}};

std::string bounds_text(Bounds bounds) {
  if (std::isinf(bounds.high)) return fmt::format("{} {}", bounds.above_low ? "above" : "of at least", bounds.low);
  return fmt::format("in {}{}, {}]", bounds.above_low ? "(" : "[", bounds.low, bounds.high);
}

}  // namespace

std::span<const ConfigKeys> config_keys() { return kObjects; }

void ConfigReader::fail(const JsonNode& node, std::string_view what) const {
  if (node.path.empty()) fail_input("{}:{}: {}", file_, node.line, what);
  fail_input("{}:{}: key '{}': {}", file_, node.line, node.path, what);
}

void ConfigReader::check_object(const JsonNode& node, std::string_view kind) const {
  const auto* const row = std::ranges::find(kObjects, kind, &ConfigKeys::object);
  check_keys(node, {row->keys.begin(), row->keys.end()});
}

void ConfigReader::check_keys(const JsonNode& node, const std::vector<std::string_view>& known) const {
  if (!node.value.is_object()) fail(node, fmt::format("expected an object, not {}", node.value.type_name()));
  for (const JsonNode& child : node.children)
    if (std::ranges::find(known, child.key) == known.end()) fail(child, unknown_text(child.key, known));
}

const JsonNode& ConfigReader::required(const JsonNode& object, std::string_view key) const {
  const JsonNode* child = object.find(key);
  if (child == nullptr) fail(object, fmt::format("'{}' is missing", key));
  return *child;
}

std::string ConfigReader::text(const JsonNode& node) const {
  if (!node.value.is_string()) fail(node, fmt::format("expected a string, not {}", node.value.type_name()));
  return node.value.get<std::string>();
}

bool ConfigReader::flag(const JsonNode& node) const {
  if (!node.value.is_boolean()) fail(node, fmt::format("expected true or false, not {}", node.value.type_name()));
  return node.value.get<bool>();
}

double ConfigReader::number(const JsonNode& node, Bounds bounds) const {
  if (!node.value.is_number())
    fail(node, fmt::format("expected a number {}, not {}", bounds_text(bounds), node.value.type_name()));
  const auto value = node.value.get<double>();
  if (value < bounds.low || value > bounds.high || (bounds.above_low && value == bounds.low))
    fail(node, fmt::format("{} is out of range (expected a number {})", value, bounds_text(bounds)));
  return value;
}

std::int64_t ConfigReader::integer(const JsonNode& node, std::int64_t low, std::int64_t high) const {
  if (!node.value.is_number_integer())
    fail(node, fmt::format("expected an integer from {} to {}, not {}", low, high,
                           node.value.is_number() ? node.value.dump() : node.value.type_name()));
  // An unsigned value over the signed range would wrap round in get<int64_t>().
  const bool huge = node.value.is_number_unsigned() && node.value.get<std::uint64_t>() > INT64_MAX;
  const auto value = huge ? INT64_MAX : node.value.get<std::int64_t>();
  if (huge || value < low || value > high)
    fail(node, fmt::format("{} is out of range (expected {} to {})", node.value.dump(), low, high));
  return value;
}

std::span<const JsonNode> ConfigReader::items(const JsonNode& node) const {
  if (!node.value.is_array()) return {&node, 1};
  if (node.children.empty()) fail(node, "the list is empty");
  return node.children;
}

}  // namespace reliefbench
