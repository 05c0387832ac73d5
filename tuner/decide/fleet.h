#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/decide/fleet_run.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// Where a setting has to do well: a device, with one scene.
struct FleetPlace {
  MeasuredDevice device;
  std::string scene;
  SceneKey scene_key{};
  std::vector<std::size_t> runs;         ///< that measured it
  double weight = 1;                     ///< mean of theirs
  std::size_t settings = 0;              ///< measured there and within the bounds
  bool is_measured = true;               ///< whether anything was
  std::optional<double> between_runs{};  ///< PlaceTimes::between_runs
};

/// What a setting costs in a place beyond that place's own best. With a bound on error: time, as a share (0.03 is 3 %);
/// with a bound on time: error, in the metric's unit.
struct Loss {
  double value = 0;
  double low = 0;  ///< its interval; all intervals of a fleet hold at once. Errors are exact.
  double high = 0;
  double time_ns = 0;             ///< the setting's, median; of several runs their geometric mean
  const TableRow* row = nullptr;  ///< of the place's first run that has it
};

/// A setting that was measured in every place and is within the bounds in all of them.
struct FleetSetting {
  Settings settings;
  std::vector<Loss> losses;  ///< parallel to the places
  Loss combined;             ///< worst or weighted mean; its time is 0
  std::int64_t memory_bytes = 0;
};

/// A place's own best, and what it costs to ship it in each place; nothing where it was not measured or misses a
/// bound.
struct OwnBest {
  Settings settings;
  std::vector<std::optional<Loss>> losses;
};

enum class Regret { minimax, mean };
[[nodiscard]] std::string_view regret_id(Regret regret);
/// throws: Error(bad_input) listing the choices
[[nodiscard]] Regret find_regret(std::string_view id);
[[nodiscard]] std::vector<std::string> regret_ids();

struct FleetOptions {
  std::vector<Budget> budgets;
  std::optional<double> max_time_ms{};    ///< then: the most accurate within it; else: the fastest within the budgets
  std::string error_metric = "e_xy.p99";  ///< what "most accurate" means
  Regret regret = Regret::minimax;
  double confidence = 0.95;  ///< of all intervals together
};

/// One setting for a fleet.
struct Fleet {
  std::vector<FleetPlace> places;
  std::vector<FleetSetting> settings;  ///< least combined loss first; the first is the pick
  std::size_t ties = 0;                ///< of the others: those whose combined interval overlaps the pick's
  std::vector<OwnBest> own;            ///< parallel to the places
  std::vector<std::string> repeated;   ///< repeated_texts() of the runs
};

/// The setting with the least loss against each place's own best: the least worst one, or the least mean by weight.
///
/// Times are those of place_times(): several runs of a place count together, and what shifts a case from one of them to
/// the next is in the intervals; of one run it is not known. Losses of time are those of losses_to_best(): their
/// intervals hold together, and what the choice of the best among many does to them is in there. A setting is within a
/// bound on time where the upper end of its own interval is. What is beyond a bound in one run of a place is no choice
/// there.
/// runs: of any devices and scenes; settings match by their ids
/// throws: Error(bad_input): an error metric where higher is better; Error(answer_is_no): no setting is measured and
///         within the bounds everywhere, saying which place leaves the fewest; Error(nothing_measured): nothing was
///         measured in a place
[[nodiscard]] Fleet choose_for_fleet(std::span<const FleetRun> runs, const FleetOptions& options);

/// The loss that a combined one is: worst, or weighted mean.
[[nodiscard]] Loss combined_loss(std::span<const Loss> losses, std::span<const FleetPlace> places, Regret regret);

/// "vulkan NVIDIA H200 in rocks/oblique"; with the driver or machine where that tells one of `all` from another
[[nodiscard]] std::string place_text(const FleetPlace& place, std::span<const FleetPlace> all);

/// CoarseFilter::kMark where an error of the setting, in one of the places, rests on a coarse sampler; or nothing.
[[nodiscard]] std::string_view coarse_mark(std::span<const Loss> losses);
/// What the marks at the pick and at the places' own bests mean: of errors that rest on a coarse sampler.
[[nodiscard]] std::set<std::string> coarse_notes(const Fleet& fleet);

/// "e_xy.p99<=0.5 and missed_rate<=0.001", "at most 2 ms"
[[nodiscard]] std::string bounds_text(const FleetOptions& options);

[[nodiscard]] nlohmann::json fleet_json(const Fleet& fleet, std::span<const FleetRun> runs,
                                        const FleetOptions& options);

}  // namespace reliefbench
