#include "tuner/tune/tune_fleet.h"

#include <fmt/format.h>

#include <limits>
#include <set>
#include <span>

#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

bool is_in(const TableRow& row, const TunePlace& place) {
  if (row.scene_key.is_known() && place.scene_key.is_known()) return row.scene_key == place.scene_key;
  return row.scene == place.scene;
}

}  // namespace

double FleetLosses::loss(const std::string& setting) const {
  if (others.empty()) return 0;
  const auto found = others.find(setting);
  return found == others.end() ? std::numeric_limits<double>::infinity() : found->second;
}

std::vector<FleetRun> runs_in_scene(std::vector<FleetRun> runs, const TunePlace& place) {
  for (FleetRun& run : runs) {
    std::set<std::string> scenes;
    for (const TableRow& row : run.rows) scenes.insert(row.scene);
    std::erase_if(run.rows, [&](const TableRow& row) { return !is_in(row, place); });
    if (run.rows.empty())
      fail_input("--fleet {}: measured nothing of the scene that is tuned on, {}{}", run.name, place.scene,
                 scenes.contains(place.scene)
                     ? ", but another scene of that name (heightmap, depth, view, frame: see --frame-px)"
                     : fmt::format("; it has {}", fmt::join(scenes, ", ")));
    for (TableRow& row : run.rows) {
      row.scene = place.scene;
      row.scene_key = place.scene_key;
    }
  }
  return runs;
}

FleetLosses losses_of_others(const std::vector<FleetRun>& runs, const TunePlace& place, const FleetOptions& options) {
  std::vector<FleetRun> others = runs;
  for (FleetRun& run : others)
    std::erase_if(run.rows, [&](const TableRow& row) { return measured_device(row) == place.device; });
  std::erase_if(others, [](const FleetRun& run) { return run.rows.empty(); });
  FleetLosses losses{.others = {}, .rule = {.is_worst = options.regret == Regret::minimax, .own_share = 1}};
  if (others.empty()) return losses;
  const Fleet fleet = choose_for_fleet(others, options);
  losses.rule.own_share = 1 / static_cast<double>(fleet.places.size() + 1);
  for (const FleetSetting& one : fleet.settings) losses.others.emplace(setting_id(one.settings), one.combined.value);
  return losses;
}

std::string fleet_sha256(const TuneFleet& fleet) {
  std::string text{regret_id(fleet.regret)};
  for (const FleetRun& run : fleet.runs)
    for (const TableRow& row : run.rows)
      text += fmt::format("{} {} {} {}\n", row.case_id, row.device, row.scene_key.hex,
                          sha256(std::as_bytes(std::span(row.samples_ns))));
  return sha256(text);
}

}  // namespace reliefbench
