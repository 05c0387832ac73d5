#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernels/base/size.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/session.h"
#include "tuner/plan/config.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/search/search.h"
#include "tuner/tune/error_pass.h"
#include "tuner/tune/tune_fleet.h"

namespace reliefbench {

/// What is asked of a search.
struct TuneQuestion {
  std::vector<Budget> max_error{};      ///< all must hold: alone they have one answer, the cheapest that meets them
  std::optional<double> max_time_ms{};  ///< then the pick is the most accurate within it, of those within max_error
  double epsilon = 0.02;                ///< the pick may be so much slower than the best, as a ratio - 1
  double confidence = 0.95;
  std::uint64_t seed = 1;
};

/// How the scenes of one setting become one time. Errors are always the worst scene's.
enum class Combine {
  weighted,  ///< sum of the scenes' frame times, each with its weight
  worst,     ///< the slowest scene's
};

struct TuneOptions {
  TuneQuestion question{};
  std::filesystem::path output{};
  std::string backend{};
  int device = 0;
  Combine combine = Combine::weighted;
  std::vector<double> weights{};  ///< one a scene; empty: all 1
  /// Scenes on which the pick is only tried. Where one has the name of another scene it is told apart by its heights'
  /// hash: "rocks.4cc2dca1/grazing".
  std::vector<SceneSpec> holdout{};
  /// One setting for these devices and this one is asked for, too: the question then has bounds on error and none on
  /// time, and there is one scene.
  std::optional<TuneFleet> fleet{};
  std::optional<double> time_limit_s{};
  std::function<bool()> is_interrupted = [] { return false; };
  bool retry_failed = false;  ///< draw again what failed in an earlier start
  bool quiet = false;
  OpenDevice open = open_device;
  double cooling_pause_s = kCoolingPause_s;
};

/// A setting that is answered with. Times: of the combined scenes, ns a frame.
struct TunePick {
  std::string setting{};    ///< setting_id()
  double error = 0;         ///< the front's metric, in the worst scene
  double time_ns = 0;       ///< estimate
  double high_ns = 0;       ///< upper confidence bound
  double rival_low_ns = 0;  ///< least lower bound of all others that would do; infinite where there is none
  double gap = 0;           ///< high / rival_low - 1, at least 0: so much slower than the best of the scored settings
                            ///< the pick may be
  std::string tie{};        ///< setting that is as fast as far as the certificate tells, but less simple; "": none
};

/// One rung from the plainest setting that does to the pick.
struct TuneRung {
  std::string setting{};
  std::vector<std::string> gained{};   ///< features that the rung before has not
  std::vector<std::string> dropped{};  ///< features of the rung before that this one has not
  double time_ns = 0;
  double high_ns = 0;
};

/// The best setting of one scene alone, and what it would gain there over the pick for all. Both times are medians of
/// the samples that this scene has, by one rule.
struct SceneAnswer {
  std::string scene{};
  std::optional<TunePick> own{};  ///< the common pick itself, where nothing was seen to be faster
  double own_ns = 0;
  double common_ns = 0;
  /// 1 - own_ns / common_ns, between what the two medians' intervals allow; all 0 where own is the common pick.
  double gain = 0;
  double gain_low = 0;
  double gain_high = 0;
};

struct HoldoutAnswer {
  std::string scene{};
  SceneKey scene_key{};
  std::string failure{};          ///< why the pick could not be drawn there; "" if it was
  std::optional<double> error{};  ///< the front's metric; none: it was not measured
  double time_ns = 0;
  std::string miss{};  ///< "e_xy.p99 is 0.61 where 0.5 is asked"; "" where the budgets hold
};

struct TuneCounts {
  int settings = 0;   ///< of the space
  int conflicts = 0;  ///< combinations that the registry refuses
  int scored = 0;     ///< error known
  int assumed = 0;    ///< not drawn: fewer steps do already
  int hopeless = 0;   ///< not drawn: more steps do not
  int failed = 0;
  int unscored = 0;  ///< out of time
  bool is_bisected = false;
};

struct TuneResult {
  TuneQuestion question{};
  std::string error_metric{};
  std::vector<Budget> constraints{};  ///< of every answer, without max_error
  std::string backend{};
  std::string device{};
  CoarseFilter filter{};                   ///< of the device, as far as known
  std::vector<std::string> frame_notes{};  ///< small_frame_notes()
  std::vector<std::string> scenes{};
  std::vector<SceneKey> scene_keys{};   ///< parallel to scenes
  std::vector<std::string> subjects{};  ///< parallel to scenes: scene_description() of each
  std::string replayed{};               ///< the table that stood for the device; "" for a device
  TuneCounts counts{};
  SearchSpace space{};  ///< of the scored settings; ids are setting_id()s
  SearchResult search{};
  std::optional<TunePick> pick{};
  std::vector<TuneRung> rungs{};
  std::vector<SceneAnswer> scene_answers{};  ///< where there are several scenes
  std::vector<HoldoutAnswer> holdout{};
  std::unique_ptr<FleetAnswer> fleet{};  ///< where a fleet was given, and some setting will do for all
  std::string fleet_refusal{};           ///< where none does: why
  std::string nearest{};                 ///< where there is no pick: the setting that misses least, if one is known
  std::string miss{};                    ///< and by how much
  bool is_stopped = false;               ///< by the time limit or the user
  double wall_s = 0;

  /// Whether every answer is certified within epsilon of the best of the whole space.
  [[nodiscard]] bool is_certified() const;
  /// What a gap among the scored settings is in the whole space: infinite where some were not scored, as any of these
  /// may be the best.
  [[nodiscard]] double gap_in_space(double gap) const;
  /// What is certified, in a sentence: of the whole space, or of which part of it.
  [[nodiscard]] std::string claim() const;
};

/// What people are told of a gap, a loss or a slack: "1.23 %", "an unknown share" where it is not finite.
[[nodiscard]] std::string gap_text(double gap);

/// Tunes on a device: scores, then times what the search asks for, into a run folder that also holds the records and
/// samples of what was measured. Goes on where an earlier start of the same question was killed.
/// throws: Error: bad config or input, another run's folder, no such device; a hold-out that is tuned on; a fleet's run
///         of another scene, a fleet that has no setting itself
[[nodiscard]] TuneResult run_tune(const Config& config, const TuneOptions& options);

/// Samples a setting after which a replay without a time limit ends: those of a few noisy frames may never make it
/// sure.
inline constexpr std::int64_t kReplayPatience = 10 * kPatience;

/// The same against a recorded sweep, whose samples are the noise. output may be empty: then nothing is kept.
[[nodiscard]] TuneResult replay_tune(const std::filesystem::path& recorded, const std::string& scene,
                                     const TuneOptions& options);

/// tune.json, configs/schema/tune.schema.json
[[nodiscard]] nlohmann::json tune_json(const TuneResult& result);

/// What the command line says of the scenes; what it does not say stays as the config has it.
struct SceneOptions {
  std::vector<std::string> views{};  ///< preset names; of the built-in config only
  std::optional<double> relief_depth{};
  std::optional<double> base{};
  std::optional<Size> frame_px{};
  std::optional<std::string> wrap{};  ///< repeat | clamp
  std::optional<double> tiling{};
};

/// The config of `tune HEIGHTMAP`: the built-in space on a heightmap (as in a config's "heightmap").
/// throws: Error(bad_input) that names the command's argument or option
[[nodiscard]] Config default_tune_config(const HeightmapSpec& heightmap, const SceneOptions& options);
/// The built-in space on the scenes of a scene file, within what nobody sees in them.
/// throws: Error(bad_input): as load_scene_file()
[[nodiscard]] Config scene_tune_config(const std::filesystem::path& path, const SceneOptions& options);
/// A config whose settings all show some features (parse_wanted_features()), each by every row that does and that the
/// setting's own rows allow. Its text is changed with it. throws: Error(bad_input): no setting can
[[nodiscard]] Config with_features(const Config& config, std::string_view features);
/// A config with its scenes changed; its text is changed with them, so that it is another question.
[[nodiscard]] Config with_scene_options(const Config& config, const SceneOptions& options);

inline constexpr std::string_view kTuneFile = "tune.json";

}  // namespace reliefbench
