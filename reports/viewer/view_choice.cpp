#include "reports/viewer/view_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr double kElevationMin_deg = 0.5;
constexpr double kDistanceMin = 0.1;
constexpr double kDistanceMax = 50;
constexpr double kZoomOfNotch = 0.9;
constexpr double kPanMost = 8;

constexpr std::array kKnobs{
    Knob{"azimuth", "azimuth", "view", "deg", -180, 180, false, [](Scene& s) -> double& { return s.view.azimuth_deg; }},
    Knob{"elevation", "elevation", "view", "deg", kElevationMin_deg, 90, false,
         [](Scene& s) -> double& { return s.view.elevation_deg; }},
    Knob{"distance", "distance", "view", "sides", kDistanceMin, kDistanceMax, true,
         [](Scene& s) -> double& { return s.view.distance; }},
    Knob{"fov", "field of view", "view", "deg", 1, 120, false, [](Scene& s) -> double& { return s.view.fov_deg; }},
    Knob{"pan", "pan", "view", "sides", -kPanMost, kPanMost, false, [](Scene& s) -> double& { return s.pan; }},
    Knob{"relief_depth", "relief depth", "relief", "of a tile", 0, 1, false,
         [](Scene& s) -> double& { return s.relief_depth; }},
    Knob{"base", "base", "relief", "height", 0, 1, false, [](Scene& s) -> double& { return s.base; }},
    Knob{"tiling", "tiling", "relief", "tiles", 0.25, 64, true, [](Scene& s) -> double& { return s.tiling; }},
    Knob{"light_elevation", "light elevation", "light", "deg", 0, 90, false,
         [](Scene& s) -> double& { return s.light.elevation_deg; }},
    Knob{"light_azimuth", "light azimuth", "light", "deg", -180, 180, false,
         [](Scene& s) -> double& { return s.light.azimuth_deg; }},
    Knob{"light_radius", "light radius", "light", "deg", 0, 20, false,
         [](Scene& s) -> double& { return s.light.angular_radius_deg; }}};

double number_in(std::string_view name, std::string_view text, double low, double high) {
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || !(value >= low && value <= high))
    fail_input("'{}' is '{}', not a number from {} to {}", name, text, low, high);
  return value;
}

bool switch_of(std::string_view name, std::string_view text) {
  if (text != "on" && text != "off") fail_input("'{}' is '{}', neither on nor off", name, text);
  return text == "on";
}

template <typename Rows>
std::size_t place_among(const Rows& rows, std::string_view name, std::string_view id) {
  return static_cast<std::size_t>(&find_row(rows, name, id) - &*std::begin(rows));
}

void set_other(ViewChoice& choice, std::string_view value) {
  if (value == "reference")
    choice.other.reset();
  else if (value == "setting")
    choice.other = choice.settings;
  else
    choice.other = parse_setting(value);
}

void set_level(ViewChoice& choice, const ViewPicks& picks, std::string_view value) {
  std::vector<std::string> known;
  for (const ViewPick& level : picks.levels) {
    known.push_back(fmt::format("{}", level.quality));
    if (known.back() != value) continue;
    choice.settings = level.settings;
    return;
  }
  if (known.empty()) fail_input("level '{}': there are no presets", value);
  fail_input("level '{}': the presets have {}", value, fmt::join(known, ", "));
}

void set_point(ViewChoice& choice, const ViewPicks& picks, std::string_view value) {
  if (picks.points.empty()) fail_input("point '{}': there is no run with a front", value);
  const double place = number_in("point", value, 1, static_cast<double>(picks.points.size()));
  choice.settings = picks.points.at(static_cast<std::size_t>(place) - 1).settings;
}

using Setter = void (*)(ViewChoice& choice, const ViewPicks& picks, std::string_view value);
struct Named {
  std::string_view id;
  Setter apply;
};
constexpr std::array kNamed{
    Named{"technique",
          [](ViewChoice& choice, const ViewPicks&, std::string_view value) {
            choice.settings = with_technique(choice.settings, find_technique(value));
          }},
    Named{"other", [](ViewChoice& choice, const ViewPicks&, std::string_view value) { set_other(choice, value); }},
    Named{"view",
          [](ViewChoice& choice, const ViewPicks&, std::string_view value) {
            choice.spec.scene.view = view_presets()[place_among(view_presets(), "view", value)];
          }},
    Named{"overlay",
          [](ViewChoice& choice, const ViewPicks&, std::string_view value) {
            choice.overlay = static_cast<Overlay>(place_among(kOverlays, "overlay", value));
          }},
    Named{"split", [](ViewChoice& choice, const ViewPicks&,
                      std::string_view value) { choice.split = number_in("split", value, 0, 1); }},
    Named{"blink", [](ViewChoice& choice, const ViewPicks&,
                      std::string_view value) { choice.blinks = switch_of("blink", value); }},
    Named{"help", [](ViewChoice& choice, const ViewPicks&,
                     std::string_view value) { choice.shows_help = switch_of("help", value); }},
    Named{"open", [](ViewChoice& choice, const ViewPicks&,
                     std::string_view value) { choice.open.at(place_among(kSections, "section", value)) = true; }},
    Named{"close", [](ViewChoice& choice, const ViewPicks&,
                      std::string_view value) { choice.open.at(place_among(kSections, "section", value)) = false; }},
    Named{"level", set_level},
    Named{"point", set_point},
};

/// "cone_steps" for "steps": the first count of steps that ends in that word.
const Param* param_called(const Settings& settings, std::string_view name) {
  for (const SettingValue& given : settings.values())
    if (given.param.id == name) return &given.param;
  for (const SettingValue& given : settings.values())
    if (given.param.counts_steps() && given.param.id.ends_with(fmt::format("_{}", name))) return &given.param;
  return nullptr;
}

[[noreturn]] void fail_unknown(const Settings& settings, std::string_view name) {
  if (settings.technique().find(name) != nullptr) fail_input("'{}' means nothing with {}", name, setting_id(settings));
  std::vector<std::string_view> known = ids_of(kNamed);
  for (const Knob& knob : kKnobs) known.push_back(knob.id);
  for (const SettingValue& given : settings.values()) known.push_back(given.param.id);
  fail_input("'{}' is {}", name, unknown_text(name, known));
}

}  // namespace

std::span<const Knob> knobs() { return kKnobs; }

Settings with_technique(const Settings& settings, const Technique& technique) {
  Settings changed(technique);
  for (const SettingValue& given : settings.values()) {
    const Param* const same = technique.find(given.param.id);
    if (same == nullptr) continue;
    try {
      changed.set(same->id, given.text());
    } catch (const Error&) {  // out of this technique's range: its default stays
      continue;
    }
  }
  return changed;
}

void set(ViewChoice& choice, const ViewPicks& picks, std::string_view name, std::string_view value) {
  if (const auto* const named = std::ranges::find(kNamed, name, &Named::id); named != kNamed.end())
    return named->apply(choice, picks, value);
  if (const auto* const knob = std::ranges::find(kKnobs, name, &Knob::id); knob != kKnobs.end()) {
    knob->in(choice.spec.scene) = number_in(name, value, knob->low, knob->high);
    return;
  }
  const Param* const param = param_called(choice.settings, name);
  if (param == nullptr) fail_unknown(choice.settings, name);
  choice.settings.set(param->id, value);
}

void orbit(Scene& scene, double azimuth_deg, double elevation_deg) {
  View& view = scene.view;
  view.azimuth_deg = std::remainder(view.azimuth_deg + azimuth_deg, 360);
  view.elevation_deg = std::clamp(view.elevation_deg + elevation_deg, kElevationMin_deg, 90.0);
}

void zoom(Scene& scene, double notches) {
  scene.view.distance = std::clamp(scene.view.distance * std::pow(kZoomOfNotch, notches), kDistanceMin, kDistanceMax);
}

void pan(Scene& scene, double sides) { scene.pan = std::clamp(scene.pan + sides, -kPanMost, kPanMost); }

}  // namespace reliefbench
