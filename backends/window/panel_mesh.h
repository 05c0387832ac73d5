#pragma once
#include <cstdint>
#include <vector>

#include "backends/window/screen.h"

namespace reliefbench {

/// A corner of a triangle.
struct PanelVertex {
  float x;  ///< clip space: -1 left, 1 right
  float y;
  float u;
  float v;
  std::uint32_t color;  ///< RGBA8
};

/// Triangles with one picture on them, within a rectangle of the window.
struct PanelPart {
  const ScreenPicture* picture;
  int left_px;  ///< of the rectangle, from the window's upper left corner
  int top_px;
  int width_px;
  int height_px;
  std::uint32_t first;  ///< index
  std::uint32_t count;  ///< of indices
};

/// What Dear ImGui has drawn, in one list each.
struct PanelMesh {
  std::vector<PanelVertex> vertices{};
  std::vector<std::uint32_t> indices{};
  std::vector<PanelPart> parts{};
};
/// y_down: whether the API's clip space has y = -1 at the top
[[nodiscard]] PanelMesh panel_mesh(const ImDrawData& drawn, bool y_down);

/// Dear ImGui's glyphs as a picture; its ImTextureID is set. It must go before the screen.
[[nodiscard]] std::unique_ptr<ScreenPicture> make_glyphs(Screen& screen);

}  // namespace reliefbench
