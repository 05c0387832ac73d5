#include "tuner/decide/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "kernels/base/error.h"
#include "tuner/decide/pareto.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr double kSlack = 1e-9;  // of a log of a time, for rounding

/// The newest measurement of each setting, by scene.
using SceneCases = std::map<std::string, PresetEvidence, std::less<>>;  ///< by settings
struct DeviceCases {
  std::string driver;
  const Run* driver_run = nullptr;
  std::map<SceneKey, std::string> names;  ///< of scenes: the first that each was met under
  std::map<std::string, SceneCases, std::less<>> scenes;
};
using DeviceKey = std::pair<std::string, std::string>;  ///< backend, device

std::string settings_text(const Record& record) {
  std::string text = record.technique;
  for (const auto& [id, value] : record.params)
    text += fmt::format("{}{}={}", &id == &record.params[0].first ? "?" : "&", id, value);
  return text;
}

/// A value that all runs must have in common.
json common_front(std::span<const Run> runs, const char* key, const json& fallback) {
  const auto value_of = [&](const Run& run) { return run.info.value("front", json::object()).value(key, fallback); };
  json first = value_of(runs.front());
  for (const Run& run : runs)
    if (value_of(run) != first)
      fail_input("{}: its front's {} is {}, that of {} is {}; say which by --error and --constraint",
                 run.folder.string(), key, value_of(run).dump(), runs.front().folder.string(), first.dump());
  return first;
}

std::string driver_of(const Run& run, const std::string& backend) {
  for (const json& device : run.info.value("devices", json::array()))
    if (device.value("backend", "") == backend) return device.value("driver", "");
  return "";
}

/// What cannot be compared must not share a table.
void check_same(const PresetEvidence& before, const PresetEvidence& now) {
  if (before.record->scene_key != now.record->scene_key)
    fail_input("scene '{}' is not the same in {} ({}) and {} ({})", now.record->scene, before.run->folder.string(),
               before.record->scene_key.short_text(), now.run->folder.string(), now.record->scene_key.short_text());
}

std::map<DeviceKey, DeviceCases> gather(std::span<const Run> runs) {
  std::map<DeviceKey, DeviceCases> devices;
  std::map<std::string, PresetEvidence> first_of_scene;
  for (const Run& run : runs)
    for (const Record& record : run.records) {
      if (record.status != Status::ok) continue;
      DeviceCases& device = devices[{record.backend, record.device}];
      const std::string driver = driver_of(run, record.backend);
      if (device.driver_run == nullptr) {
        device.driver = driver;
        device.driver_run = &run;
      }
      if (device.driver != driver)
        fail_input("{}, {}: its driver is '{}' in {}, '{}' in {}; their times make no one table", record.backend,
                   record.device, device.driver, device.driver_run->folder.string(), driver, run.folder.string());
      const PresetEvidence evidence{.run = &run, .record = &record, .error = 0};
      check_same(first_of_scene.try_emplace(record.scene, evidence).first->second, evidence);
      // A scene under another name is the same scene.
      const std::string& name = record.scene_key.is_known()
                                    ? device.names.try_emplace(record.scene_key, record.scene).first->second
                                    : record.scene;
      device.scenes[name][settings_text(record)] = evidence;
    }
  return devices;
}

/// A setting that counts.
struct Choice {
  std::vector<PresetEvidence> evidence;  ///< parallel to the device's scenes
  double relative_time = 0;
  double error = 0;
};

/// The settings of all scenes, with the error of the worst one.
std::vector<Choice> shared_choices(const DeviceCases& device, const std::string& error_metric) {
  std::vector<Choice> choices;
  for (const auto& [text, ignored] : device.scenes.begin()->second) {
    Choice choice;
    for (const auto& [scene, cases] : device.scenes) {
      const auto found = cases.find(text);
      if (found == cases.end()) break;
      choice.evidence.push_back(found->second);
      choice.evidence.back().error =
          metric_value(*found->second.record, error_metric).value_or(std::numeric_limits<double>::infinity());
      choice.error = std::max(choice.error, choice.evidence.back().error);
    }
    if (choice.evidence.size() == device.scenes.size()) choices.push_back(std::move(choice));
  }
  return choices;
}

double time_ns(const PresetEvidence& evidence) { return evidence.record->frame_time->summary.median; }

/// Finds the fastest of each scene, and every choice's time relative to it.
std::vector<SceneFloor> set_relative_times(std::vector<Choice>& choices) {
  std::vector<SceneFloor> floors;
  for (std::size_t s = 0; s < choices.front().evidence.size(); ++s) {
    const Choice& fastest =
        *std::ranges::min_element(choices, {}, [s](const Choice& choice) { return time_ns(choice.evidence[s]); });
    floors.push_back({.scene = fastest.evidence[s].record->scene, .fastest = fastest.evidence[s].record});
    for (Choice& choice : choices)
      choice.relative_time =
          std::max(choice.relative_time, time_ns(choice.evidence[s]) / floors[s].fastest->frame_time->summary.median);
  }
  return floors;
}

/// By rising time and falling error.
std::vector<Choice> front_of(const std::vector<Choice>& choices) {
  std::vector<double> times;
  std::vector<double> errors;
  for (const Choice& choice : choices) {
    times.push_back(choice.relative_time);
    errors.push_back(choice.error);
  }
  std::vector<Choice> front;
  for (const std::size_t i : pareto_front(times, errors)) front.push_back(choices[i]);
  return front;
}

/// front: not empty
std::vector<PresetLevel> levels_of(const std::vector<Choice>& front) {
  const double cheapest = std::log(front.front().relative_time);
  const double dearest = std::log(front.back().relative_time);
  std::vector<PresetLevel> levels;
  for (int quality = 0; quality <= 100; quality += kPresetStep) {
    const double limit = std::lerp(cheapest, dearest, quality / 100.0) + kSlack;
    const auto beyond =
        std::ranges::find_if(front, [&](const Choice& choice) { return std::log(choice.relative_time) > limit; });
    const Choice& choice = *std::prev(beyond);  // the cheapest one is never beyond
    levels.push_back({.quality = quality,
                      .relative_time = choice.relative_time,
                      .error = choice.error,
                      .evidence = choice.evidence});
  }
  return levels;
}

DevicePresets device_presets(const DeviceKey& key, const DeviceCases& device, const Presets& presets) {
  DevicePresets result{.backend = key.first, .device = key.second, .driver = device.driver, .scenes = {}, .levels = {}};
  std::set<std::string> measured;
  std::vector<std::string> counts;
  for (const auto& [scene, cases] : device.scenes) {
    for (const auto& [text, ignored] : cases) measured.insert(text);
    counts.push_back(fmt::format("{}: {}", scene, cases.size()));
  }
  result.measured = static_cast<int>(measured.size());
  std::vector<Choice> choices = shared_choices(device, presets.error_metric);
  result.shared = static_cast<int>(choices.size());
  if (choices.empty())
    fail_input("{}, {}: no setting was measured in all of its {} scenes ({}); sweep them with the same settings",
               key.first, key.second, device.scenes.size(), fmt::join(counts, ", "));
  const auto is_feasible = [&](const Choice& choice) {
    return std::isfinite(choice.error) && std::ranges::all_of(choice.evidence, [&](const PresetEvidence& evidence) {
             return std::ranges::all_of(presets.constraints,
                                        [&](const Budget& budget) { return meets(*evidence.record, budget); });
           });
  };
  std::erase_if(choices, [&](const Choice& choice) { return !is_feasible(choice); });
  result.feasible = static_cast<int>(choices.size());
  if (choices.empty()) {
    std::vector<std::string> bounds;
    for (const Budget& budget : presets.constraints) bounds.push_back(budget.text());
    throw Error(
        Exit::answer_is_no,
        fmt::format("{}, {}: of the {} settings that its {} scenes share none has a value of {} and meets {} in all",
                    key.first, key.second, result.shared, device.scenes.size(), presets.error_metric,
                    fmt::join(bounds, ", ")));
  }
  result.scenes = set_relative_times(choices);
  const std::vector<Choice> front = front_of(choices);
  result.on_front = static_cast<int>(front.size());
  result.levels = levels_of(front);
  return result;
}

}  // namespace

Presets make_presets(std::span<const Run> runs, const PresetQuery& query) {
  const Config defaults;
  std::vector<std::string> default_constraints;
  for (const Budget& budget : defaults.front_constraints) default_constraints.push_back(budget.text());

  Presets presets;
  presets.error_metric =
      query.error_metric ? *query.error_metric : common_front(runs, "error", defaults.front_error).get<std::string>();
  if (!find_metric(presets.error_metric).lower_is_better)
    fail_input("'{}' is no error: higher is better", presets.error_metric);
  presets.constraints =
      query.constraints
          ? *query.constraints
          : parse_budgets(common_front(runs, "constraints", default_constraints).get<std::vector<std::string>>());
  for (const Run& run : runs) presets.runs.push_back(&run);
  for (const auto& [key, device] : gather(runs)) presets.devices.push_back(device_presets(key, device, presets));
  if (presets.devices.empty()) throw Error(Exit::nothing_measured, "the runs hold no case that was measured");
  return presets;
}

}  // namespace reliefbench
