#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backends/window/screen.h"
#include "kernels/judge/score.h"
#include "kernels/trace/technique.h"
#include "tuner/measure/frame.h"
#include "tuner/plan/case.h"

namespace reliefbench {

/// What the device has of one setting, and what is known of its picture.
struct Pane {
  explicit Pane(Screen& screen, int width_px, int height_px)
      : picture(screen.make_picture(width_px, height_px)), overlay(screen.make_picture(width_px, height_px)) {}

  std::optional<Settings> settings{};  ///< that `frame` draws; none: nothing is there yet
  std::string map_key{};               ///< of the map that `frame` has
  UploadedScene uploaded{};
  Scene scene{};  ///< that was drawn last
  Frame frame{};
  std::string failure{};     ///< why what is wanted is not drawn; "": it is, or is on its way
  std::string failed_key{};  ///< picture_key() of what is not tried again; "": nothing

  bool compiles_next = false;  ///< what is wanted waits for its pipeline, which the next update compiles

  std::unique_ptr<ScreenPicture> picture;
  std::string picture_key{};  ///< of what the picture shows; "": nothing

  std::string judged_key{};  ///< of the picture that the rest is about; "": of none
  std::optional<FrameScore> score{};
  PixelScores scores{};       ///< frame size, row-major
  std::vector<float> taps{};  ///< likewise; negative without a ray
  std::unique_ptr<ScreenPicture> overlay;
  std::string overlay_key{};  ///< of what it shows

  [[nodiscard]] bool is_drawn() const { return !picture_key.empty(); }
  [[nodiscard]] bool is_judged() const { return is_drawn() && judged_key == picture_key; }
};

/// What a setting's map is made of, but for the heightmap: settings with the same text share it on the device.
[[nodiscard]] std::string map_key(const Settings& settings, const SceneSpec& spec);
/// What a setting's picture is made of.
[[nodiscard]] std::string picture_key(const Settings& settings, const SceneSpec& spec);

}  // namespace reliefbench
