#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "reports/viewer/live_pictures.h"
#include "reports/viewer/view_choice.h"

namespace reliefbench {

inline constexpr int kPanelWidth_px = 340;
inline constexpr int kPicturesLeastWidth_px = 480;
inline constexpr int kPanelLeastHeight_px = 680;

/// What the panel asks of the window beside a changed choice.
struct PanelWishes {
  bool screenshot = false;
  bool close = false;
  std::string_view copied{};  ///< one of copied_kinds(); "": nothing
};

/// What the panel keeps between frames that is no part of what is shown.
struct PanelState {
  View home{};           ///< where `r` leads back to
  std::string notice{};  ///< of what was last written, copied or refused
  bool times_always = false;
  bool moves_split = false;          ///< while the pointer holds it
  std::optional<Settings> edited{};  ///< left setting, while a slider is held
  std::optional<Settings> edited_other{};
};

struct PanelContext {
  ViewChoice& choice;
  const ViewPicks& picks;
  const LivePictures& pictures;
  PanelState& state;
};

/// Draws pictures and panel with Dear ImGui, and puts what is done to them into the choice.
[[nodiscard]] PanelWishes draw_view(const PanelContext& context);

// Its parts, a file each.
struct Area {
  float left;
  float top;
  float width;
  float height;
};
void draw_pictures(const PanelContext& context, const Area& area);
void draw_settings(Settings& settings, std::optional<Settings>& edited, const char* id);
void draw_picks(const PanelContext& context);
void draw_help(ViewChoice& choice);

}  // namespace reliefbench
