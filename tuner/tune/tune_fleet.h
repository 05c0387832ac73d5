#pragma once
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tuner/decide/fleet.h"
#include "tuner/search/regret.h"

namespace reliefbench {

/// Earlier runs of other devices, for which one setting is wanted together with the one that is tuned on.
struct TuneFleet {
  std::vector<FleetRun> runs{};
  Regret regret = Regret::minimax;
};

/// What the other devices lose with each setting; what it loses here is for the search to find.
struct FleetLosses {
  /// Combined loss of the other places, by setting_id(); of settings that they measured and that are within the budgets
  /// there.
  std::map<std::string, double> others{};
  RegretRule rule{};
  /// Of a setting; infinite where the fleet can't have it.
  [[nodiscard]] double loss(const std::string& setting) const;
};

/// Where one is tuned: a device and a scene.
struct TunePlace {
  MeasuredDevice device;
  std::string scene;
  SceneKey scene_key{};
};

/// The runs of a scene. Scenes match by key, by name where a table does not know its key.
/// throws: Error(bad_input): a run that measured nothing of it
[[nodiscard]] std::vector<FleetRun> runs_in_scene(std::vector<FleetRun> runs, const TunePlace& place);

/// runs: of runs_in_scene(); those of the place itself have no say here, as its times are what is searched for
/// throws: as choose_for_fleet()
[[nodiscard]] FleetLosses losses_of_others(const std::vector<FleetRun>& runs, const TunePlace& place,
                                           const FleetOptions& options);

/// The fleet's setting, by choose_for_fleet(), of the settings that were timed here.
struct FleetAnswer {
  std::vector<FleetRun> runs;  ///< what was timed here is the first
  FleetOptions options;
  Fleet fleet;  ///< points into the runs
  /// By the search's bounds, with its confidence: no setting's combined loss is less than low, the pick's is no more
  /// than high. The other places' losses count as they are estimated.
  double low = 0;
  double high = std::numeric_limits<double>::infinity();
};

/// What of a fleet makes one question another: every case and sample, and the rule.
[[nodiscard]] std::string fleet_sha256(const TuneFleet& fleet);

}  // namespace reliefbench
