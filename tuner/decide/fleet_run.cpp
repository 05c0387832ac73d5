#include "tuner/decide/fleet_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <system_error>
#include <tuple>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_parts.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

/// Whether samples are others times one factor, but for rounding.
bool is_in_proportion(const std::vector<double>& samples, const std::vector<double>& others) {
  constexpr double kRounding = 1e-12;
  return std::ranges::equal(samples, others, [&](double own, double other) {
    return std::abs(own * others.front() - other * samples.front()) <= kRounding * own * others.front();
  });
}

/// Whether two cases have the very same samples, as precisely as a table has them. Samples that are all equal, as of a
/// coarse timer, say nothing.
/// share_a_part: their runs do; a merge may have brought its times to another machine's speed
bool is_repeated(const TableRow& a, const TableRow& b, bool share_a_part) {
  const std::vector<double>& samples = a.samples_ns;
  const bool is_told = std::ranges::adjacent_find(samples, std::not_equal_to{}) != samples.end();
  return is_told && (std::ranges::equal(samples, b.samples_ns, {}, table_sample_ns, table_sample_ns) ||
                     (share_a_part && is_in_proportion(samples, b.samples_ns)));
}

/// Takes from later runs of a place what an earlier one holds.
/// keys: of each run's parts
void drop_repeated(const std::vector<std::vector<std::string>>& keys, MeasuredPlace& place) {
  std::map<std::string, std::vector<std::pair<std::size_t, const TableRow*>>> seen;  // by setting; with the run
  MeasuredPlace kept = place;
  kept.runs.clear();
  kept.cases.clear();
  for (std::size_t k = 0; k < place.runs.size(); ++k) {
    std::map<std::size_t, std::size_t> repeated;  // by the earlier run
    std::vector<const TableRow*> cases;
    std::set<std::size_t> sharing;  // earlier runs that have a part of it
    for (const std::size_t earlier : std::span(place.runs).first(k))
      if (std::ranges::find_first_of(keys[earlier], keys[place.runs[k]]) != keys[earlier].end())
        sharing.insert(earlier);
    for (const TableRow* row : place.cases[k]) {
      auto& earlier = seen[setting_id(row->settings)];
      const auto same = std::ranges::find_if(
          earlier, [&](const auto& one) { return is_repeated(*one.second, *row, sharing.contains(one.first)); });
      if (same != earlier.end() && same->first != place.runs[k]) {
        ++repeated[same->first];
        continue;
      }
      earlier.emplace_back(place.runs[k], row);
      cases.push_back(row);
    }
    for (const auto& [run, count] : repeated)
      kept.repeated.push_back({.run = place.runs[k], .earlier = run, .cases = count});
    const bool adds = std::ranges::any_of(cases, [](const TableRow* row) { return row->status == Status::ok; });
    if (!repeated.empty() && !adds) continue;
    kept.runs.push_back(place.runs[k]);
    kept.cases.push_back(std::move(cases));
  }
  place = std::move(kept);
}

}  // namespace

FleetRun fleet_run(const Run& run) { return {.name = run.folder.string(), .rows = case_table(run), .info = run.info}; }

FleetRun load_fleet_run(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) return {.name = path.string(), .rows = load_case_table(path)};
  return fleet_run(load_run(path));
}

std::vector<Budget> common_budgets(std::span<const FleetRun> runs) {
  std::vector<Budget> budgets;
  for (const FleetRun& run : runs) {
    std::vector<Budget> own = question_of(run.info).budgets;
    if (&run == runs.data())
      budgets = std::move(own);
    else if (budget_texts(own) != budget_texts(budgets))
      fail_input("{} and {} have other budgets; say which hold by --max-error", runs.front().name, run.name);
  }
  return budgets;
}

std::string device_text(const MeasuredDevice& device, std::span<const MeasuredDevice> all) {
  std::string text = fmt::format("{} {}", device.backend, device.device);
  const auto same_name = [&](const MeasuredDevice& other) {
    return other.backend == device.backend && other.device == device.device;
  };
  const auto differs = [&](auto member) {
    return std::ranges::any_of(
        all, [&](const MeasuredDevice& other) { return same_name(other) && other.*member != device.*member; });
  };
  if (differs(&MeasuredDevice::driver))
    text += fmt::format(" ({})", device.driver.empty() ? "driver not recorded" : device.driver);
  if (differs(&MeasuredDevice::machine))
    text += fmt::format(" on {}", device.machine.empty() ? "a machine not recorded" : device.machine);
  return text;
}

std::vector<MeasuredPlace> places_of(std::span<const FleetRun> runs) {
  const auto where = [](const TableRow& row) {
    return std::tie(row.backend, row.device, row.driver, row.machine, row.scene, row.scene_key);
  };
  std::vector<MeasuredPlace> places;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const TableRow* before = nullptr;
    std::size_t index = 0;
    for (const TableRow& row : runs[i].rows) {
      const bool goes_on = before != nullptr && where(*before) == where(row);
      before = &row;
      if (!goes_on) {
        const MeasuredDevice device = measured_device(row);
        const auto is_it = [&](const MeasuredPlace& place) {
          return place.device == device && place.scene_key == row.scene_key && place.scene == row.scene;
        };
        index = static_cast<std::size_t>(std::ranges::find_if(places, is_it) - places.begin());
        if (index == places.size())
          places.push_back({.device = device, .scene = row.scene, .scene_key = row.scene_key, .runs = {}, .cases = {}});
      }
      MeasuredPlace& place = places[index];
      if (place.runs.empty() || place.runs.back() != i) {
        place.runs.push_back(i);
        place.cases.emplace_back();
      }
      place.cases.back().push_back(&row);
    }
  }
  std::vector<std::vector<std::string>> keys;
  keys.reserve(runs.size());
  for (const FleetRun& run : runs) keys.push_back(part_keys(run.info));
  for (MeasuredPlace& place : places)
    if (place.runs.size() > 1) drop_repeated(keys, place);
  return places;
}

std::vector<std::string> repeated_texts(std::span<const MeasuredPlace> places, std::span<const FleetRun> runs) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> counts;
  for (const MeasuredPlace& place : places)
    for (const RepeatedCases& one : place.repeated) counts[{one.run, one.earlier}] += one.cases;
  std::vector<std::string> texts;
  texts.reserve(counts.size());
  for (const auto& [pair, count] : counts)
    texts.push_back(fmt::format("{}: {} of its cases are the same measurement as in {} and count once",
                                runs[pair.first].name, count, runs[pair.second].name));
  return texts;
}

}  // namespace reliefbench
