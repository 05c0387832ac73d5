#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/case_table.h"

namespace reliefbench {

/// A run of the fleet: its folder or table.csv, and what it holds.
struct FleetRun {
  std::string name;  ///< as it was given
  std::vector<TableRow> rows;
  double weight = 1;
};

/// Where a setting has to do well: a device, with one scene.
struct FleetPlace {
  std::size_t run = 0;
  std::string backend;
  std::string device;
  std::string scene;
  SceneKey scene_key{};
  double weight = 1;
  std::size_t settings = 0;  ///< measured there and within the budgets
};

/// How much more time a setting takes in a place than that place's own best, as a share: 0.03 is 3 %.
struct Loss {
  double value = 0;
  double low = 0;  ///< its interval; all intervals of a fleet hold at once
  double high = 0;
  double time_ns = 0;  ///< the setting's, median
};

/// A setting that was measured in every place and is within the budgets in all of them.
struct FleetSetting {
  Settings settings;
  std::vector<Loss> losses;  ///< parallel to the places
  Loss combined;             ///< worst or weighted mean; its time is 0
  std::int64_t memory_bytes = 0;
};

/// A place's own best, and what it costs to ship it in each place; nothing where it was not measured or misses a
/// budget.
struct OwnBest {
  Settings settings;
  std::vector<std::optional<Loss>> losses;
};

enum class Regret { minimax, mean };

struct FleetOptions {
  std::vector<Budget> budgets;
  Regret regret = Regret::minimax;
  double confidence = 0.95;  ///< of all intervals together
};

/// One setting for a fleet.
struct Fleet {
  std::vector<FleetPlace> places;
  std::vector<FleetSetting> settings;  ///< least combined loss first; the first is the pick
  std::size_t ties = 0;                ///< of the others: those whose combined interval overlaps the pick's
  std::vector<OwnBest> own;            ///< parallel to the places
};

/// The setting with the least loss against each place's own best: the least worst one, or the least mean by weight.
///
/// A setting's log time in a place is a Huber location of its samples, its variance moderated by those of the place's
/// other settings. The intervals of all of them hold together (Bonferroni). A loss lies between the least that its
/// setting's time can be over the most that the place's best can take, and the reverse; so what the choice of the best
/// among many does to it is in the interval. Not in it: what shifts a case from one run of a device to the next.
/// runs: of any devices and scenes; settings match by their ids
/// throws: Error(bad_input): one place in two runs; no setting is measured and within the budgets everywhere, saying
///         which place leaves the fewest
[[nodiscard]] Fleet choose_for_fleet(std::span<const FleetRun> runs, const FleetOptions& options);

/// The loss that a combined one is: worst, or weighted mean.
[[nodiscard]] Loss combined_loss(std::span<const Loss> losses, std::span<const FleetPlace> places, Regret regret);

/// "vulkan NVIDIA H200 in rocks/oblique"
[[nodiscard]] std::string place_text(const FleetPlace& place);

[[nodiscard]] nlohmann::json fleet_json(const Fleet& fleet, std::span<const FleetRun> runs,
                                        const FleetOptions& options);

}  // namespace reliefbench
