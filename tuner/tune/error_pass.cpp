#include "tuner/tune/error_pass.h"

#include <algorithm>
#include <chrono>
#include <map>

#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

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

/// van der Corput's sequence in base 2, in [0, 1): 0.5, 0.25, 0.75, 0.125, ... Its first n lie evenly, for every n.
double van_der_corput(std::size_t i) {
  double value = 0;
  double digit = 0.5;
  for (++i; i > 0; i /= 2, digit /= 2)
    if (i % 2 == 1) value += digit;
  return value;
}

/// All items, those of each technique in turn, and of a technique spread over all that it has.
/// settings_of: the setting that stands for an item
std::vector<std::size_t> spread_order(std::size_t items,
                                      const std::function<const Settings&(std::size_t)>& setting_of) {
  std::map<const Technique*, std::vector<std::size_t>> by_technique;
  for (std::size_t i = 0; i < items; ++i) by_technique[&setting_of(i).technique()].push_back(i);
  std::vector<std::size_t> order;
  order.reserve(items);
  for (std::size_t turn = 0; order.size() < items; ++turn)
    for (auto& [technique, left] : by_technique) {
      if (left.empty()) continue;
      const auto place = static_cast<std::size_t>(van_der_corput(turn) * static_cast<double>(left.size()));
      order.push_back(left[place]);
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(place));
    }
  return order;
}

}  // namespace

ErrorPass::ErrorPass(std::span<const Settings> settings, std::size_t scenes, Frames frames)
    : settings_(settings),
      scenes_(scenes),
      frames_(std::move(frames)),
      scores_(settings.size()),
      order_(spread_order(settings.size(), [&](std::size_t i) -> const Settings& { return settings[i]; })) {}

bool ErrorPass::score(std::size_t setting) {
  if (frames_.should_stop(done_)) return false;
  SettingScore& result = scores_[setting];
  if (result.scored != Scored::no) return true;
  try {
    for (std::size_t scene = 0; scene < scenes_; ++scene) result.scores.push_back(frames_.judge(setting, scene));
    result.scored = Scored::yes;
  } catch (const FileError&) {  // a full disk ends the run: it says nothing about the setting
    throw;
  } catch (const DeviceGone&) {  // likewise
    throw;
  } catch (const Error& error) {
    result = {.scored = Scored::failed, .failure = error.what()};
  }
  ++done_;
  return true;
}

double ErrorPass::score_coarse() {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t wanted = std::min(kCoarse, order_.size() / 4);
  std::size_t drawn = 0;
  while (drawn < wanted && score(order_[drawn])) ++drawn;
  const double taken_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return taken_s * static_cast<double>(order_.size()) / static_cast<double>(std::max<std::size_t>(drawn, 1));
}

void ErrorPass::score_rest() {
  // In the settings' own order, in which those that share a map stand together.
  for (std::size_t setting = 0; setting < settings_.size(); ++setting)
    if (scores_[setting].scored == Scored::no && !score(setting)) return;
}

void ErrorPass::bisect(const std::function<bool(const FrameScore&)>& meets) {
  const std::vector<std::vector<std::size_t>> lines = lines_of(settings_);
  for (const std::size_t line :
       spread_order(lines.size(), [&](std::size_t i) -> const Settings& { return settings_[lines[i].front()]; }))
    if (!bisect_line(lines[line], meets)) return;
}

bool ErrorPass::bisect_line(std::span<const std::size_t> line, const std::function<bool(const FrameScore&)>& meets) {
  std::size_t first = 0;  // the first that meets the budgets is in [first, last]
  std::size_t last = line.size();
  while (first < last) {
    const std::size_t middle = first + (last - first) / 2;
    const SettingScore& result = scores_[line[middle]];
    if (!score(line[middle])) return false;
    if (result.scored == Scored::yes && std::ranges::all_of(result.scores, meets))
      last = middle;
    else
      first = middle + 1;
  }
  for (std::size_t i = 0; i < line.size(); ++i) {
    Scored& scored = scores_[line[i]].scored;
    if (scored != Scored::no) continue;
    scored = i < first ? Scored::hopeless : Scored::assumed;
    ++done_;
  }
  return true;
}

}  // namespace reliefbench
