#include "tuner/decide/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "kernels/base/error.h"
#include "tuner/decide/choose.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/preset_levels.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr double kUnseen = 0.02;  // of the cheapest setting's error: what is less counts as none
constexpr double kSlack = 1e-9;   // of a level's error, for rounding
constexpr std::size_t kFewLevels = 3;

/// The newest measurement of each setting, by scene.
using SceneCases = std::map<std::string, PresetEvidence, std::less<>>;  ///< by settings
struct DeviceCases {
  MeasuredDevice device;
  const Run* run = nullptr;               ///< the first that measured on it
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

/// What all runs must have in common, unless the query says it.
RunQuestion common_question(std::span<const Run> runs, const PresetQuery& query) {
  RunQuestion first = question_of(runs.front());
  const auto check = [&](const Run& run, std::string_view what, const std::string& own, const std::string& firsts) {
    if (own != firsts)
      fail_input("{}: its {} is {}, that of {} is {}; say which by --error and --constraint", run.folder.string(), what,
                 own, runs.front().folder.string(), firsts);
  };
  const auto joined = [](const std::vector<Budget>& budgets) {
    return fmt::format("'{}'", fmt::join(budget_texts(budgets), " and "));
  };
  for (const Run& run : runs) {
    const RunQuestion own = question_of(run);
    if (!query.error_metric) check(run, "front's error", own.error_metric, first.error_metric);
    if (query.constraints) continue;
    check(run, "front's constraints", joined(own.constraints), joined(first.constraints));
    check(run, "budget", joined(own.budgets), joined(first.budgets));
  }
  return first;
}

/// Whether the shaded frames of a device were compared.
bool has_seen_errors(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) {
    return std::ranges::any_of(run.records, [](const Record& record) {
      return record.status == Status::ok && metric_value(record, kSeenMetric).value_or(0) > 0;
    });
  });
}

/// Two drivers, or two machines whose processors draw, must not share a table.
void check_same_device(const DeviceCases& before, const MeasuredDevice& now, const Run& run) {
  const auto check = [&](std::string_view what, const std::string& firsts, const std::string& own) {
    if (firsts != own)
      fail_input("{}, {}: {} '{}' in {}, '{}' in {}; their times make no one table", now.backend, now.device, what,
                 firsts, before.run->folder.string(), own, run.folder.string());
  };
  check("its driver is", before.device.driver, now.driver);
  check("it draws on", before.device.machine, now.machine);
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
  for (const Run& run : runs) {
    std::set<DeviceKey> checked;
    for (const Record& record : run.records) {
      if (record.status != Status::ok) continue;
      const DeviceKey key(record.backend, record.device);
      DeviceCases& device = devices[key];
      if (checked.insert(key).second) {
        const MeasuredDevice own = measured_device(run.info, record.backend, record.device);
        if (device.run == nullptr) {
          device.device = own;
          device.run = &run;
        }
        check_same_device(device, own, run);
      }
      const PresetEvidence evidence{.run = &run, .record = &record, .error = 0};
      check_same(first_of_scene.try_emplace(record.scene, evidence).first->second, evidence);
      // A scene under another name is the same scene.
      const std::string& name = record.scene_key.is_known()
                                    ? device.names.try_emplace(record.scene_key, record.scene).first->second
                                    : record.scene;
      device.scenes[name][settings_text(record)] = evidence;
    }
  }
  return devices;
}

/// A setting that counts.
struct LevelCandidate {
  std::vector<PresetEvidence> evidence{};  ///< parallel to the device's scenes
  double relative_time = 0;
  double error = 0;
  double level_error = 0;
  Contender contender{};  ///< its times are relative ones
};

const Summary& time_of(const PresetEvidence& evidence) { return evidence.record->frame_time->summary; }

/// The settings of all scenes, with the errors of the worst one.
std::vector<LevelCandidate> shared_settings(const DeviceCases& device, const Presets& presets) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<LevelCandidate> candidates;
  for (const auto& [text, ignored] : device.scenes.begin()->second) {
    LevelCandidate candidate;
    for (const auto& [scene, cases] : device.scenes) {
      const auto found = cases.find(text);
      if (found == cases.end()) break;
      const Record& record = *found->second.record;
      candidate.evidence.push_back(found->second);
      candidate.evidence.back().error = metric_value(record, presets.error_metric).value_or(kInfinity);
      candidate.error = std::max(candidate.error, candidate.evidence.back().error);
      candidate.level_error =
          std::max(candidate.level_error, metric_value(record, presets.level_metric).value_or(kInfinity));
      candidate.contender.memory_bytes = std::max(candidate.contender.memory_bytes, record.memory_bytes);
    }
    if (candidate.evidence.size() == device.scenes.size()) candidates.push_back(std::move(candidate));
  }
  return candidates;
}

/// Finds the fastest of each scene, and every setting's time relative to it.
std::vector<SceneFloor> set_relative_times(std::vector<LevelCandidate>& candidates) {
  std::vector<SceneFloor> floors;
  for (std::size_t s = 0; s < candidates.front().evidence.size(); ++s) {
    const LevelCandidate& fastest = *std::ranges::min_element(
        candidates, {}, [s](const LevelCandidate& candidate) { return time_of(candidate.evidence[s]).median; });
    floors.push_back({.scene = fastest.evidence[s].record->scene, .fastest = fastest.evidence[s].record});
    const double fastest_ns = floors[s].fastest->frame_time->summary.median;
    for (LevelCandidate& candidate : candidates) {
      const Summary& time = time_of(candidate.evidence[s]);
      candidate.relative_time = std::max(candidate.relative_time, time.median / fastest_ns);
      candidate.contender.low_ns = std::max(candidate.contender.low_ns, time.ci_low / fastest_ns);
      candidate.contender.high_ns = std::max(candidate.contender.high_ns, time.ci_high / fastest_ns);
    }
  }
  for (LevelCandidate& candidate : candidates)
    candidate.contender.simplicity = simplicity(*candidate.evidence.front().record);
  return floors;
}

/// By rising time and falling error, in what levels are spaced by.
std::vector<LevelCandidate> front_of(const std::vector<LevelCandidate>& candidates) {
  std::vector<double> times;
  std::vector<double> errors;
  for (const LevelCandidate& candidate : candidates) {
    times.push_back(candidate.relative_time);
    errors.push_back(candidate.level_error);
  }
  std::vector<LevelCandidate> front;
  for (const std::size_t i : pareto_front(times, errors)) front.push_back(candidates[i]);
  return front;
}

/// candidates, front: not empty
std::vector<PresetLevel> device_levels(const std::vector<LevelCandidate>& candidates,
                                       const std::vector<LevelCandidate>& front, const Presets& presets) {
  using Picked = const LevelCandidate*;
  const auto pick = [&](double limit, const Picked* above) {
    std::vector<Picked> as_good;
    std::vector<Contender> contenders;
    for (const LevelCandidate& candidate : candidates) {
      const bool keeps_order =
          above == nullptr || &candidate == *above ||
          (candidate.relative_time <= (*above)->relative_time && candidate.level_error >= (*above)->level_error);
      if (candidate.level_error > limit || !keeps_order) continue;
      as_good.push_back(&candidate);
      contenders.push_back(candidate.contender);
    }
    return as_good[choose(contenders).pick];
  };
  const LevelRange range{.loosest = front.front().level_error, .least = front.back().level_error};
  std::vector<PresetLevel> levels;
  for (const auto& [quality, picked] : levels_of<Picked>(range, presets, pick, std::equal_to{}))
    levels.push_back({.quality = quality,
                      .relative_time = picked->relative_time,
                      .error = picked->error,
                      .level_error = picked->level_error,
                      .evidence = picked->evidence});
  return levels;
}

/// What every level must have a value of.
std::string metrics_text(const Presets& presets) {
  if (presets.error_metric == presets.level_metric) return presets.error_metric;
  return fmt::format("{} and {}", presets.error_metric, presets.level_metric);
}

DevicePresets device_presets(const DeviceKey& key, const DeviceCases& device, Presets& presets) {
  DevicePresets result{
      .backend = key.first, .device = key.second, .driver = device.device.driver, .scenes = {}, .levels = {}};
  std::set<std::string> measured;
  std::vector<std::string> counts;
  for (const auto& [scene, cases] : device.scenes) {
    for (const auto& [text, ignored] : cases) measured.insert(text);
    counts.push_back(fmt::format("{}: {}", scene, cases.size()));
  }
  result.measured = static_cast<int>(measured.size());
  std::vector<LevelCandidate> candidates = shared_settings(device, presets);
  result.shared = static_cast<int>(candidates.size());
  if (candidates.empty())
    fail_input("{}, {}: no setting was measured in all of its {} scenes ({}); sweep them with the same settings",
               key.first, key.second, device.scenes.size(), fmt::join(counts, ", "));
  const auto is_feasible = [&](const LevelCandidate& candidate) {
    return std::isfinite(candidate.error) && std::isfinite(candidate.level_error) &&
           std::ranges::all_of(candidate.evidence, [&](const PresetEvidence& evidence) {
             return std::ranges::all_of(presets.constraints,
                                        [&](const Budget& budget) { return meets(*evidence.record, budget); });
           });
  };
  std::erase_if(candidates, [&](const LevelCandidate& candidate) { return !is_feasible(candidate); });
  result.feasible = static_cast<int>(candidates.size());
  if (candidates.empty()) {
    throw Error(
        Exit::answer_is_no,
        fmt::format("{}, {}: of the {} settings that its {} scenes share none has a value of {} and meets {} in all; "
                    "other bounds by --constraint",
                    key.first, key.second, result.shared, device.scenes.size(), metrics_text(presets),
                    fmt::join(budget_texts(presets.constraints), ", ")));
  }
  result.scenes = set_relative_times(candidates);
  const std::vector<LevelCandidate> front = front_of(candidates);
  result.on_front = static_cast<int>(front.size());
  result.levels = device_levels(candidates, front, presets);
  warn_of_few_levels(presets, fmt::format("{}, {}", key.first, key.second), result.levels.size(), candidates.size());
  return result;
}

}  // namespace

void warn_of_few_levels(Presets& presets, std::string_view what, std::size_t levels, std::size_t settings) {
  if (levels >= kFewLevels) return;
  const bool is_tuned = std::ranges::any_of(presets.runs, [](const Run* run) { return is_of_tune(*run); });
  presets.warnings.push_back(
      fmt::format("{}: {} distinct level{} of {} settings within {}; {}", what, levels, levels == 1 ? "" : "s",
                  settings, fmt::join(budget_texts(presets.constraints), ", "),
                  is_tuned ? "a tune's folder holds only the settings that it answers with: sweep for more"
                           : "sweep more settings, or allow more error by --constraint"));
}

double level_limit(double loosest, double least, int quality, const Presets& presets) {
  const double share = static_cast<double>(quality) / kBestPreset;
  const double seen = std::max(least, kUnseen * loosest);
  const bool is_linear = presets.level_metric == kSeenMetric;
  if (!is_linear && loosest <= 0) return 0;
  const double limit =
      is_linear ? std::lerp(loosest, seen, share) : std::exp(std::lerp(std::log(loosest), std::log(seen), share));
  return limit * (1 + kSlack);
}

Presets asked_presets(std::span<const Run> runs, const PresetQuery& query) {
  const RunQuestion common = common_question(runs, query);
  Presets presets;
  presets.error_metric = query.error_metric.value_or(common.error_metric);
  if (!find_metric(presets.error_metric).lower_is_better)
    fail_input("'{}' is no error: higher is better", presets.error_metric);
  presets.level_metric = !query.error_metric && has_seen_errors(runs) ? std::string(kSeenMetric) : presets.error_metric;
  presets.constraints = query.constraints.value_or(common.constraints);
  if (!query.constraints)
    for (const Budget& budget : common.budgets) {
      const auto is_it = [&](const Budget& other) { return other.text() == budget.text(); };
      if (std::ranges::none_of(presets.constraints, is_it)) presets.constraints.push_back(budget);
    }
  for (const Run& run : runs) presets.runs.push_back(&run);
  return presets;
}

Presets make_presets(std::span<const Run> runs, const PresetQuery& query) {
  Presets presets = asked_presets(runs, query);
  for (const auto& [key, device] : gather(runs)) presets.devices.push_back(device_presets(key, device, presets));
  if (presets.devices.empty()) throw Error(Exit::nothing_measured, "the runs hold no case that was measured");
  return presets;
}

std::string_view coarse_mark(const PresetLevel& level) {
  for (const PresetEvidence& one : level.evidence)
    if (const std::string_view mark = one.filter().mark(one.record->case_id); !mark.empty()) return mark;
  return "";
}

std::set<std::string> coarse_notes(const Presets& presets) {
  std::set<std::string> notes;
  for (const DevicePresets& device : presets.devices)
    for (const PresetLevel& level : device.levels)
      for (const PresetEvidence& one : level.evidence)
        if (const CoarseFilter filter = one.filter(); !filter.mark(one.record->case_id).empty())
          notes.insert(filter.note());
  return notes;
}

}  // namespace reliefbench
