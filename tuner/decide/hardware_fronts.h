#pragma once
#include <span>
#include <string>

#include "tuner/decide/hardware.h"
#include "tuner/decide/place_times.h"

namespace reliefbench {

/// What one column knows of a scene.
struct FrontColumn {
  std::size_t column = 0;
  std::string scene;
  const PlaceTimes* times = nullptr;
};
/// The Pareto fronts of one scene on several devices. columns: not empty
[[nodiscard]] SceneFronts scene_fronts(std::span<const FrontColumn> columns, const HardwareOptions& options);

}  // namespace reliefbench
