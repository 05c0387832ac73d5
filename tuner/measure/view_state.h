#pragma once
#include "backends/window.h"
#include "kernels/trace/view.h"

namespace reliefbench {

/// What `view` shows.
struct ViewState {
  View view;
  int level = 0;             ///< of the device's presets, from the cheapest
  bool shows_error = false;  ///< the error map instead of the shaded frame

  bool operator==(const ViewState&) const = default;
};

inline constexpr double kElevationMin_deg = 0.5;
inline constexpr double kDistanceMin = 0.1;
inline constexpr double kDistanceMax = 50;

/// The state after these events. home: where Key::r leads back to; levels: how many there are to choose from
[[nodiscard]] ViewState steer(ViewState state, const WindowEvents& events, const View& home, int levels);

}  // namespace reliefbench
