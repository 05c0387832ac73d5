#include "backends/window/panel_mesh.h"

#include <imgui.h>

#include <algorithm>

namespace reliefbench {
namespace {

/// The part of a command's rectangle that is in the window; its width or height is 0 or less where none is.
PanelPart part_of(const ImDrawCmd& command, const ImDrawData& drawn) {
  // Dear ImGui counts in the window's units, of which a pixel may be a part.
  const ImVec2 scale = drawn.FramebufferScale;
  const float right = std::min(command.ClipRect.z - drawn.DisplayPos.x, drawn.DisplaySize.x);
  const float bottom = std::min(command.ClipRect.w - drawn.DisplayPos.y, drawn.DisplaySize.y);
  const int left_px = static_cast<int>(std::max(0.0F, command.ClipRect.x - drawn.DisplayPos.x) * scale.x);
  const int top_px = static_cast<int>(std::max(0.0F, command.ClipRect.y - drawn.DisplayPos.y) * scale.y);
  return {.picture = static_cast<const ScreenPicture*>(command.GetTexID()),
          .left_px = left_px,
          .top_px = top_px,
          .width_px = static_cast<int>(right * scale.x) - left_px,
          .height_px = static_cast<int>(bottom * scale.y) - top_px,
          .first = 0,
          .count = command.ElemCount};
}

}  // namespace

PanelMesh panel_mesh(const ImDrawData& drawn, bool y_down) {
  PanelMesh mesh;
  const float scale_x = 2 / drawn.DisplaySize.x;
  const float scale_y = (y_down ? 2.0F : -2.0F) / drawn.DisplaySize.y;
  const float top = y_down ? -1.0F : 1.0F;
  for (int i = 0; i < drawn.CmdListsCount; ++i) {
    const ImDrawList& list = *drawn.CmdLists[i];
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const ImDrawVert& vertex : list.VtxBuffer)
      mesh.vertices.push_back({.x = (vertex.pos.x - drawn.DisplayPos.x) * scale_x - 1,
                               .y = (vertex.pos.y - drawn.DisplayPos.y) * scale_y + top,
                               .u = vertex.uv.x,
                               .v = vertex.uv.y,
                               .color = vertex.col});
    for (const ImDrawCmd& command : list.CmdBuffer) {
      PanelPart part = part_of(command, drawn);
      if (part.width_px <= 0 || part.height_px <= 0 || part.count == 0) continue;
      part.first = static_cast<std::uint32_t>(mesh.indices.size());
      for (unsigned int k = 0; k < command.ElemCount; ++k)
        mesh.indices.push_back(base + command.VtxOffset + list.IdxBuffer[static_cast<int>(command.IdxOffset + k)]);
      mesh.parts.push_back(part);
    }
  }
  return mesh;
}

std::unique_ptr<ScreenPicture> make_glyphs(Screen& screen) {
  ImGuiIO& io = ImGui::GetIO();
  io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
  io.Fonts->Flags |= ImFontAtlasFlags_NoBakedLines;  // those want a linear filter
  unsigned char* rgba8 = nullptr;
  int width = 0;
  int height = 0;
  io.Fonts->GetTexDataAsRGBA32(&rgba8, &width, &height);
  std::unique_ptr<ScreenPicture> glyphs = screen.make_picture(width, height);
  screen.fill(*glyphs, {rgba8, static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4});
  io.Fonts->SetTexID(glyphs.get());
  return glyphs;
}

}  // namespace reliefbench
