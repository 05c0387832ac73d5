#include "tuner/measure/view_state.h"

#include <algorithm>
#include <cmath>

namespace reliefbench {
namespace {

constexpr double kTurn_deg_per_px = 0.4;
constexpr double kZoomOfNotch = 0.9;

}  // namespace

ViewState steer(ViewState state, const WindowEvents& events, const View& home, int levels) {
  View& view = state.view;
  // The relief follows the pointer.
  view.azimuth_deg = std::remainder(view.azimuth_deg - kTurn_deg_per_px * events.drag_x_px, 360);
  view.elevation_deg = std::clamp(view.elevation_deg + kTurn_deg_per_px * events.drag_y_px, kElevationMin_deg, 90.0);
  view.distance = std::clamp(view.distance * std::pow(kZoomOfNotch, events.wheel), kDistanceMin, kDistanceMax);
  for (const Key key : events.keys) {
    if (key == Key::left) state.level = std::max(state.level - 1, 0);
    if (key == Key::right) state.level = std::min(state.level + 1, std::max(levels - 1, 0));
    if (key == Key::tab) state.shows_error = !state.shows_error;
    if (key == Key::r) view = home;
  }
  return state;
}

}  // namespace reliefbench
