#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "kernels/base/size.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// How large frames are of scenes that do not say it (SceneSpec::has_default_frame).
struct DefaultFrame {
  std::optional<Size> size_px{};  ///< none: as Scene has it
  std::string why;                ///< in a line
};

/// Hardware is measured in frames that fill it, 1080p; software rasterisers, which any frame fills, in Scene's, which
/// cost less. All devices of a run draw the same scenes: one that is hardware decides for all. In a run that is gone on
/// with, frames stay as they were.
/// devices: none, where it is not known yet what draws. folder: of the run; none: it begins
[[nodiscard]] DefaultFrame default_frame(std::span<const DeviceInfo> devices, const Config& config,
                                         const std::filesystem::path& folder);
[[nodiscard]] DefaultFrame default_frame(std::span<const DeviceInfo> devices);

[[nodiscard]] bool has_default_frames(std::span<const SceneSpec> scenes);
/// Gives the scenes that say no size that one; then they say it.
void set_default_frames(std::span<SceneSpec> scenes, const DefaultFrame& frame);
/// The same in the config's text, too: another size is another question.
void set_default_frames(Config& config, const DefaultFrame& frame);
/// Gives all scenes a size.
void set_frames(std::span<SceneSpec> scenes, Size size_px);
/// The same in the config's text, too.
void set_frames(Config& config, Size size_px);

}  // namespace reliefbench
