#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// Whether frames of a size keep all of a device busy: in frames that are too small a pixel costs more than it would in
/// a game's, and not the same more with every technique (on an H200 1.2 to 1.5 times at 256x256).
struct FrameFill {
  int width_px = 0;
  int height_px = 0;
  double pixel_cost = 1;  ///< of the control case, over what it costs in frames of twice the sides

  [[nodiscard]] bool is_too_small() const { return pixel_cost > 1.1; }
};

/// Of run.json's devices, as "frame_fill".
[[nodiscard]] nlohmann::json fills_json(std::span<const FrameFill> fills);
/// info: run.json. A sentence for each device and size of frames that is too small for it
/// throws: Error(bad_input): a key of a wrong type
[[nodiscard]] std::vector<std::string> small_frame_notes(const nlohmann::json& info);

}  // namespace reliefbench
