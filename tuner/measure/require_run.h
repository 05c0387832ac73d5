#pragma once
#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/decide/require.h"
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
};

/// A set of features with the setting that draws it, and its picture against the full reference in the worst view.
struct SeenSet {
  FeatureSet set = 0;
  Settings settings;
  double value = 0;      ///< of the metric that is asked for
  std::size_t view = 0;  ///< the worst, a place in SceneFile::scenes
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
  Summary price_ns{};  ///< frame time with it less that without it, over all views: medians of differences in turns
  FeaturePictures pictures{};  ///< in the worst view of the set without it; empty where none were asked for
};

/// What a scene requires.
struct RequireReport {
  const SceneFile* file = nullptr;
  std::vector<MeasuredScene> views{};
  std::string backend;
  std::string device;
  bool is_software = false;
  std::string timer;
  bool is_exhaustive = false;
  std::size_t sets = 0;                 ///< that there are
  std::vector<std::string> features{};  ///< FeatureSet's bits
  std::vector<TriedRow> rows{};
  std::vector<SeenSet> seen{};        ///< in the order in which they were drawn
  bool is_met = false;                ///< false: `answer` is the set that is seen least, and seen it is
  FeatureSet answer = 0;              ///< of several as small the fastest
  std::vector<FeatureSet> ties{};     ///< all of them
  Summary frame_time_ns{};            ///< of the answer, the mean over the views
  std::vector<FeatureWorth> worth{};  ///< in the order of `features`

  [[nodiscard]] const SeenSet& at(FeatureSet set) const;
  [[nodiscard]] std::vector<std::string> names(FeatureSet set) const;
};

/// Draws the scene with sets of its features, each against the full reference (exact hits, every feature that there is,
/// exact) in every view, the worst view deciding; finds the smallest whose picture nobody tells from it; and times it
/// in turns with the sets round it.
/// throws: Error(environment): no such device, a frame that is not drawn; Error(bad_input): conflicting settings
[[nodiscard]] RequireReport run_require(const SceneFile& file, const RequireOptions& options);

/// configs/schema/require.schema.json
[[nodiscard]] nlohmann::json require_json(const RequireReport& report);

inline constexpr int kRequireSchema = 1;  ///< its layout; raised when that changes
inline constexpr std::string_view kRequireFile = "require.json";
inline constexpr std::string_view kRequirePage = "require.html";

}  // namespace reliefbench
