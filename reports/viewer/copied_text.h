#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "reports/viewer/view_choice.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// What is known of a setting in the view that is copied.
struct CopiedView {
  const ViewChoice* choice = nullptr;
  std::string heights_sha256{};
  std::string backend{};
  std::string device{};
  std::string driver{};
  std::vector<double> times_ns{};  ///< of frames of just that; empty: none was drawn
  double error = 0;                ///< e_xy.p99
};

/// The id of what is seen: "rocks/oblique", or "rocks/view" where the camera is no preset's.
[[nodiscard]] std::string viewed_scene_id(const SceneSpec& spec);

/// kind: one of copied_kinds(): a case's id; a config with one scene and one case; a presets.json with one level,
/// 100. throws: Error(bad_input): a preset without frame times
[[nodiscard]] std::string copied_text(std::string_view kind, const CopiedView& view);

}  // namespace reliefbench
