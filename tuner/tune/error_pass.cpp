#include "tuner/tune/error_pass.h"

#include <algorithm>
#include <chrono>
#include <map>

#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

using ScoreCase = std::function<FrameScore(std::size_t, std::size_t)>;

SettingScore score_one(std::size_t setting, std::size_t scenes, const ScoreCase& judge) {
  SettingScore result{.scored = Scored::yes};
  try {
    for (std::size_t scene = 0; scene < scenes; ++scene) result.scores.push_back(judge(setting, scene));
  } catch (const FileError&) {  // a full disk ends the run: it says nothing about the setting
    throw;
  } catch (const Error& error) {
    result = {.scored = Scored::failed, .failure = error.what()};
  }
  return result;
}

/// The parameter that a line runs along: the count of search steps. Null: the setting is alone on its line.
const Param* line_param(const Settings& settings) {
  const std::vector<Param>& params = settings.technique().params;
  const auto found = std::ranges::find_if(
      params, [&](const Param& param) { return param.choices.empty() && settings.is_active(param); });
  return found == params.end() || found->stage == Stage::bake ? nullptr : &*found;
}

/// Settings that differ in one step count only, by rising count.
std::vector<std::vector<std::size_t>> lines_of(std::span<const Settings> settings) {
  std::map<std::string, std::vector<std::pair<int, std::size_t>>> by_rest;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const Param* const param = line_param(settings[i]);
    Settings rest = settings[i];
    int count = 0;
    if (param != nullptr) {
      count = settings[i].get(param->id);
      rest.set(param->id, param->fallback);
    }
    by_rest[std::string(rest.technique().id) + "?" + rest.text()].emplace_back(count, i);
  }
  std::vector<std::vector<std::size_t>> lines;
  for (auto& [rest, line] : by_rest) {
    std::ranges::sort(line);
    std::vector<std::size_t>& indices = lines.emplace_back();
    for (const auto& [count, index] : line) indices.push_back(index);
  }
  return lines;
}

}  // namespace

std::vector<SettingScore> score_all(std::size_t settings, std::size_t scenes, const ScoreCase& judge,
                                    const std::function<bool(std::size_t done)>& should_stop) {
  std::vector<SettingScore> results(settings);
  // Within each pass in the plan's order, in which settings that share a map stand together.
  const std::size_t step = std::max<std::size_t>(settings / kCoarse, 1);
  std::size_t done = 0;
  const auto pass = [&](const auto& is_due) {
    for (std::size_t i = 0; i < settings; ++i) {
      if (!is_due(i)) continue;
      if (should_stop(done++)) return false;
      results[i] = score_one(i, scenes, judge);
    }
    return true;
  };
  if (pass([&](std::size_t i) { return i % step == 0; })) pass([&](std::size_t i) { return i % step != 0; });
  return results;
}

double estimate_pass_s(std::size_t settings, std::size_t scenes, const ScoreCase& judge,
                       const std::function<bool(std::size_t done)>& should_stop) {
  const std::size_t step = std::max<std::size_t>(settings / kProbes, 1);
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < settings && !should_stop(0); i += step) static_cast<void>(score_one(i, scenes, judge));
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() * static_cast<double>(step);
}

std::vector<SettingScore> score_by_bisection(std::span<const Settings> settings, std::size_t scenes,
                                             const ScoreCase& judge,
                                             const std::function<bool(const FrameScore&)>& meets,
                                             const std::function<bool(std::size_t done)>& should_stop) {
  std::vector<SettingScore> results(settings.size());
  std::size_t done = 0;
  for (const std::vector<std::size_t>& line : lines_of(settings)) {
    std::size_t first = 0;  // the first that meets the budgets is in [first, last]
    std::size_t last = line.size();
    while (first < last && !should_stop(done)) {
      const std::size_t middle = first + (last - first) / 2;
      SettingScore& result = results[line[middle]];
      result = score_one(line[middle], scenes, judge);
      if (result.scored == Scored::yes && std::ranges::all_of(result.scores, meets))
        last = middle;
      else
        first = middle + 1;
    }
    if (first < last) break;  // stopped
    for (std::size_t i = 0; i < line.size(); ++i) {
      Scored& scored = results[line[i]].scored;
      if (scored == Scored::no) scored = i < first ? Scored::hopeless : Scored::assumed;
    }
    done += line.size();
  }
  return results;
}

}  // namespace reliefbench
