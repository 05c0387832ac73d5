#include "tuner/results/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "tuner/results/device_json.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// A scalar as text; "" of anything else, and where it is not there.
std::string scalar_at(const json& object, const char* path) {
  const json::json_pointer pointer(path);
  if (!object.contains(pointer)) return "";
  const json& value = object.at(pointer);
  if (value.is_string()) return value.get<std::string>();
  return value.is_number() || value.is_boolean() ? value.dump() : std::string();
}

/// The frame sizes of a run's scenes: "256x256, 512x512"
std::string frames_text(const json& info) {
  std::set<std::string> sizes;
  const auto scenes = info.find("scenes");
  if (scenes == info.end() || !scenes->is_array()) return "";
  for (const json& scene : *scenes) {
    const std::string width = scalar_at(scene, "/frame_px/0");
    const std::string height = scalar_at(scene, "/frame_px/1");
    if (!width.empty() && !height.empty()) sizes.insert(fmt::format("{}x{}", width, height));
  }
  return fmt::format("{}", fmt::join(sizes, ", "));
}

struct TraitRow {
  const char* id = nullptr;
  const char* path = nullptr;  ///< in run.json, or in its device
  bool of_device = false;
  std::size_t digits = std::string::npos;  ///< of a hash: as many as people are shown
};

constexpr std::size_t kHashDigits = 8;
constexpr TraitRow kTraits[] = {
    {.id = "device", .path = "/name", .of_device = true},
    {.id = "driver", .path = "/driver", .of_device = true},
    {.id = "API", .path = "/api_version", .of_device = true},
    {.id = "software", .path = "/software", .of_device = true},
    {.id = "timer", .path = "/timer", .of_device = true},
    {.id = "host", .path = "/host/name", .of_device = false},
    {.id = "CPU", .path = "/host/cpu", .of_device = false},
    {.id = "cores", .path = "/host/cores", .of_device = false},
    {.id = "governor", .path = "/host/governor", .of_device = false},
    {.id = "max kHz", .path = "/host/max_khz", .of_device = false},
    {.id = "OS", .path = "/host/os", .of_device = false},
    {.id = "kernel", .path = "/host/kernel", .of_device = false},
    {.id = "version", .path = "/version", .of_device = false},
    {.id = "git sha", .path = "/git_sha", .of_device = false},
    {.id = "kernels", .path = "/identity/kernels_sha256", .of_device = false, .digits = kHashDigits},
    {.id = "config", .path = "/identity/config_sha256", .of_device = false, .digits = kHashDigits},
    {.id = "samples", .path = "/config/measure/samples", .of_device = false},
    {.id = "batch ms", .path = "/config/measure/batch_ms", .of_device = false},
};

}  // namespace

Environment measured_environment(const json& info, std::string_view backend) {
  Environment environment;
  if (!info.is_object()) return environment;
  const json device = device_of(info, backend);
  for (const TraitRow& row : kTraits) {
    const std::string value = scalar_at(row.of_device ? device : info, row.path).substr(0, row.digits);
    if (!value.empty()) environment.emplace_back(row.id, value);
  }
  if (const std::string frames = frames_text(info); !frames.empty()) environment.emplace_back("frame px", frames);
  return environment;
}

std::string_view trait(const Environment& environment, std::string_view id) {
  const auto found = std::ranges::find(environment, id, [](const auto& one) { return std::string_view(one.first); });
  return found == environment.end() ? std::string_view() : std::string_view(found->second);
}

std::vector<EnvironmentDifference> environment_differences(std::span<const Environment> environments) {
  std::vector<std::string> ids;
  for (const Environment& environment : environments)
    for (const auto& [id, value] : environment)
      if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  std::vector<EnvironmentDifference> differences;
  for (const std::string& id : ids) {
    EnvironmentDifference difference{.what = id, .values = {}};
    std::set<std::string_view> known;
    for (const Environment& environment : environments) {
      const std::string_view value = trait(environment, id);
      difference.values.emplace_back(value);
      if (!value.empty()) known.insert(value);
    }
    if (known.size() > 1) differences.push_back(std::move(difference));
  }
  return differences;
}

json environment_json(std::span<const EnvironmentDifference> differences) {
  json list = json::array();
  for (const EnvironmentDifference& difference : differences) {
    json values = json::array();
    for (const std::string& value : difference.values) values.push_back(value.empty() ? json(nullptr) : json(value));
    list.push_back({{"what", difference.what}, {"values", std::move(values)}});
  }
  return list;
}

}  // namespace reliefbench
