#pragma once
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/size.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/session.h"
#include "tuner/plan/claims_config.h"
#include "tuner/results/statistics.h"

namespace reliefbench {

enum class ClaimVerdict {
  reproduced,
  not_reproduced,
  not_testable,
  throttled,  ///< it rests on frame times, and the device was held back
};
[[nodiscard]] std::string_view claim_verdict_id(ClaimVerdict verdict);

/// In one scene of a contest: a setting, and how many times as fast another one is.
struct ClaimDuel {
  std::string scene;
  std::string of;
  std::string by;
  Summary times_as_fast;
};

/// "1.25 [1.20, 1.31]"
[[nodiscard]] std::string times_text(const Summary& times_as_fast);

struct ClaimAnswer {
  ClaimVerdict verdict = ClaimVerdict::not_testable;
  std::string numbers;  ///< "0.12 texels against 0.34", the paper's beside ours where it has one
  std::vector<std::vector<std::string>> table{};  ///< over several scenes: lines of cells, a head first
  std::vector<ClaimDuel> duels{};                 ///< of a contest: what was compared, scene by scene
};

/// What was measured of a row.
struct ClaimFigures {
  std::map<std::string, double> values{};  ///< by metric
  std::vector<double> times_ns{};          ///< of its frames, one a round, as the other rows'; none: held back
  std::string untimed{};                   ///< why its map, which is baked, has no bake_time, ""
};

/// All rows in one scene.
struct SceneFigures {
  const SceneSpec* scene = nullptr;
  Size map_px{};                     ///< of its heights
  std::vector<ClaimFigures> rows{};  ///< parallel to Claim::rows
  std::string failure{};             ///< why they could not all be drawn: then there are no rows
  std::string held_back{};           ///< what held the device back whenever they were timed: no time counts
};

/// A claim as it came out on one device.
struct ClaimResult {
  const Claim* claim = nullptr;
  std::string backend;
  std::string device;
  bool is_software = false;
  std::vector<SceneFigures> scenes;  ///< of Claim::scenes
  std::vector<std::string> missing;  ///< known heightmaps that are not there: their scenes were left out
  int undone = 0;                    ///< scenes that an interrupted run did not come to
  std::vector<ClaimAnswer> answers;  ///< parallel to Claim::checks
};

/// Draws claims as large as the papers do where a device is hardware: at 1080p, procedural heightmaps of 512x512 at
/// least. Images keep their size. frame_px: of all frames, whatever draws them
/// returns: what was chosen for hardware and why, in a line; "": there is none
[[nodiscard]] std::string set_sizes(std::span<Claim> claims, std::span<const DeviceInfo> devices,
                                    std::optional<Size> frame_px);

struct ClaimOptions {
  std::vector<std::string> backends;
  int device = 0;
  bool quiet = false;
  OpenDevice open = open_device;
  double cooling_pause_s = kCoolingPause_s;
  std::function<bool()> is_interrupted = [] { return false; };  ///< asked before each scene, and each row is prepared
};
/// Runs the claims on every backend. A paper's figures of time are a GPU's: a software rasteriser's are measured and
/// shown, but checks against them are `not_testable`. Contests compare times of one device, whichever it is. Hardware
/// bakes by itself what is asked for its bake_time; a kind that has no GPU baker, or none that this device takes, has
/// none, and checks of it are `not_testable`. Where the device is held back, a scene's rows are timed again, see
/// draw_block(); where it stays so, what rests on their times is `throttled`. A claim of which a scene can't be drawn,
/// at the second attempt() either, is `not_testable`; so is one of which an interrupted run drew no scene. throws:
/// Error(environment): no such device, no valid timer; Error(bad_input): a heightmap is not there, of several all
[[nodiscard]] std::vector<ClaimResult> run_claims(std::span<const Claim> claims, const ClaimOptions& options);

/// How a check comes out on what was measured while nothing held the device back.
[[nodiscard]] ClaimAnswer judge_claim(const Claim& claim, const ClaimCheck& check,
                                      std::span<const ClaimFigures> measured, bool is_software);

/// Of several scenes it holds where it holds in each.
/// scenes: at least one
[[nodiscard]] ClaimAnswer judge_in_each(const Claim& claim, const ClaimCheck& check,
                                        std::span<const SceneFigures> scenes, bool is_software);

/// A contest over the scenes: the geometric mean of quotients of times. Settings are chosen by the first, third, ...
/// round and the quotients taken from the others, so that the choice of the fastest does not flatter it. Intervals are
/// those of the rounds' means: of the times' noise, not of other maps. A software rasteriser's times count: the
/// quotients are of the same shaders on the same device.
/// scenes: at least one
[[nodiscard]] ClaimAnswer judge_contest(const Claim& claim, const ClaimCheck& check,
                                        std::span<const SceneFigures> scenes);

[[nodiscard]] nlohmann::json claims_json(std::span<const ClaimResult> results);

}  // namespace reliefbench
