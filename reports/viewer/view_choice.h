#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"
#include "tuner/plan/case.h"

namespace reliefbench {

/// What lies over the picture of a setting.
enum class Overlay { none, error, missed, taps };
struct OverlayRow {
  std::string_view id;
  std::string_view description;
};
inline constexpr std::array kOverlays{
    // in the order of Overlay
    OverlayRow{"none", "the shaded frame alone"},
    OverlayRow{"error", "distance of every hit to the exact one, in texels"},
    OverlayRow{"missed", "pixels that stepped over the first hit or stopped early, over the shaded frame"},
    OverlayRow{"taps", "texture instructions of every pixel"}};

/// A part of the panel that folds.
enum class Section { setting, picks, compare, error, times, scene };
struct SectionRow {
  std::string_view id;
  std::string_view label;
  bool is_open;  ///< at first
};
inline constexpr std::array kSections{
    // in the order of Section
    SectionRow{"setting", "Setting", true},  SectionRow{"picks", "Presets and front", true},
    SectionRow{"compare", "Compare", true},  SectionRow{"error", "Error of this view", true},
    SectionRow{"times", "Frame time", true}, SectionRow{"scene", "View, relief, light", false}};

/// A setting that can be picked by itself: a quality level of presets, a point of a run's front.
struct ViewPick {
  Settings settings;
  std::string label;   ///< "quality 50", "relaxed_cone cone_steps=16"
  int quality = -1;    ///< of a level; -1: it is a point
  double time_ns = 0;  ///< as measured; 0: unknown
  double error = 0;    ///< of ViewChoices::error_metric
};
/// What there is to pick from.
struct ViewPicks {
  std::vector<ViewPick> levels{};  ///< from the cheapest
  std::vector<ViewPick> points{};  ///< by rising time
  std::string error_metric{};      ///< of the points
};

/// All that the viewer shows, and how.
struct ViewChoice {
  Settings settings;
  SceneSpec spec;                   ///< its view is the camera
  std::optional<Settings> other{};  ///< on the right of the split; none: the exact reference
  double split = 0.5;               ///< where it is, 0 to 1 from the left
  bool blinks = false;              ///< both in turns in the whole picture
  Overlay overlay = Overlay::none;
  bool shows_help = false;
  std::array<bool, kSections.size()> open = [] {
    std::array<bool, kSections.size()> at_first{};
    for (std::size_t i = 0; i < at_first.size(); ++i) at_first.at(i) = kSections.at(i).is_open;
    return at_first;
  }();

  [[nodiscard]] bool& is_open(Section section) { return open.at(static_cast<std::size_t>(section)); }
};

/// A number of the scene: a row makes a slider and a word of scripts.
struct Knob {
  std::string_view id;
  std::string_view label;
  std::string_view group;  ///< view | relief | light
  std::string_view unit;   ///< "" : none
  double low;
  double high;
  bool is_logarithmic;
  double& (*in)(Scene& scene);
};
[[nodiscard]] std::span<const Knob> knobs();

/// Sets what goes by a name: "technique", a parameter of it ("cone_steps", or "steps" for its first count of steps),
/// "other" ("reference", "setting" for the one on the left as it is now, or a setting's id), "view", "overlay",
/// "split", "blink", "help", "level", "point", "open" or "close" (a section), or a knob. throws: Error(bad_input): no
/// such name or value
void set(ViewChoice& choice, const ViewPicks& picks, std::string_view name, std::string_view value);

/// Another technique with all parameters of the old one that it has, too.
[[nodiscard]] Settings with_technique(const Settings& settings, const Technique& technique);

/// The camera: turned about the middle of the plane by so much, as far as it stays above the plane.
void orbit(Scene& scene, double azimuth_deg, double elevation_deg);
void zoom(Scene& scene, double notches);  ///< nearer, by a tenth each
void pan(Scene& scene, double sides);     ///< along u

}  // namespace reliefbench
