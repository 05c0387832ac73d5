#pragma once
#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/decide/require.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/session.h"
#include "tuner/plan/scene_file.h"
#include "tuner/results/statistics.h"

namespace reliefbench {

/// How the sets of features are gone through.
enum class RequireSearch {
  automatic,  ///< every set where there are at most kMostEnumerated, else greedily
  exhaustive,
  greedy,
};
inline constexpr std::size_t kMostEnumerated = 64;

struct RequireOptions {
  std::string backend;
  int device = 0;
  RequireSearch search = RequireSearch::automatic;
  bool has_pictures = false;  ///< draw what the answer rests on
  bool quiet = false;
  OpenDevice open = open_device;
  double cooling_pause_s = kCoolingPause_s;
};

/// A set of features with the setting that draws it, and its picture against the full reference in the worst view.
struct SeenSet {
  FeatureSet set = 0;
  Settings settings;
  double value = 0;      ///< of the metric that is asked for
  std::size_t view = 0;  ///< the worst, a place in SceneFile::scenes
};

/// A setting that can't be drawn in one of the views: its picture counts as infinitely far from the reference.
struct FailedSetting {
  Settings settings;
  std::string reason;  ///< "rocks_256x256/oblique: crashed: signal 11"
};

/// A row that might stand for a feature, alone over the displaced relief.
struct TriedRow {
  std::string feature;  ///< what the row brings, e.g. "penumbra"
  std::string choice;   ///< "shadow=soft_cone"
  double value = 0;
  bool is_chosen = false;  ///< of all that bring the same it is seen least
};

/// The same frame without and with a feature, beside what both are held against. RGBA8
struct FeaturePictures {
  std::vector<std::uint8_t> without;
  std::vector<std::uint8_t> with;
  std::vector<std::uint8_t> reference;
};

/// What a feature is worth: the answer against the nearest set that has it not, or has it.
struct FeatureWorth {
  std::string name;
  std::string choice;  ///< the row that stands for it; of "displacement" the technique
  bool is_needed = false;
  FeatureSet without = 0;
  FeatureSet with = 0;
  /// Frame time with it less that without it, over all views: medians of differences in turns; of no round where the
  /// device was held back.
  Summary price_ns{};
  FeaturePictures pictures{};  ///< in the worst view of the set without it; empty where none were asked for
};

/// What a scene requires.
struct RequireReport {
  SceneFile file;  ///< every view with its frame's size
  std::vector<MeasuredScene> views{};
  std::string backend;
  std::string device;
  bool is_software = false;
  std::string timer;
  bool is_exhaustive = false;
  std::size_t sets = 0;                 ///< that there are
  std::vector<std::string> features{};  ///< FeatureSet's bits
  std::vector<TriedRow> rows{};
  std::vector<SeenSet> seen{};  ///< in the order in which they were drawn
  std::vector<FailedSetting> failed{};
  bool is_met = false;             ///< false: `answer` is the set that is seen least, and seen it is
  FeatureSet answer = 0;           ///< of several as small the fastest, or the first, see ties_held_back
  std::vector<FeatureSet> ties{};  ///< all of them
  /// What held the device back while the ties, or the answer and the sets round it, were drawn, again and again: then
  /// no time counts. "": nothing did
  std::string ties_held_back{};
  std::string times_held_back{};
  Summary frame_time_ns{};            ///< of the answer, the mean over the views; of no round where it was held back
  std::vector<FeatureWorth> worth{};  ///< in the order of `features`

  [[nodiscard]] const SeenSet& at(FeatureSet set) const;
  [[nodiscard]] std::vector<std::string> names(FeatureSet set) const;
};

/// Draws the scene with sets of its features, each against the full reference (exact hits, every feature that there is,
/// exact) in every view, the worst view deciding; finds the smallest whose picture nobody tells from it; and times it
/// in turns with the sets round it.
/// Where the device is held back, frames are drawn again, see draw_block(); where it stays so, they have no times.
/// What fails is drawn once more where it lost the device, see attempt().
/// throws: Error(environment): no such device, no setting that can be drawn, frames that fail when they are timed;
/// Error(bad_input): conflicting settings
[[nodiscard]] RequireReport run_require(const SceneFile& file, const RequireOptions& options);

/// configs/schema/require.schema.json
[[nodiscard]] nlohmann::json require_json(const RequireReport& report);

inline constexpr int kRequireSchema = 1;  ///< its layout; raised when that changes
inline constexpr std::string_view kRequireFile = "require.json";
inline constexpr std::string_view kRequirePage = "require.html";

}  // namespace reliefbench
