// The pictures beside the panel: what is left and right of the split, what lies over them, and the camera.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reports/viewer/overlay.h"
#include "reports/viewer/view_panel.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

constexpr double kTurn_deg_per_px = 0.4;
constexpr float kGrip_px = 6;
constexpr float kLabelMargin_px = 6;
constexpr double kBlink_s = 0.6;

ImU32 color_of(const Rgb& rgb) { return IM_COL32(rgb[0], rgb[1], rgb[2], 255); }
ImTextureID texture_of(const ScreenPicture& picture) { return const_cast<ScreenPicture*>(&picture); }

/// The largest place for a frame in its own proportions, in whole texels where it can be.
Area fitted_into(const Area& area, const ScreenPicture& frame) {
  const auto width = static_cast<float>(frame.width_px);
  const auto height = static_cast<float>(frame.height_px);
  float scale = std::min(area.width / width, area.height / height);
  if (scale > 1) scale = std::floor(scale);
  return {.left = std::floor(area.left + (area.width - width * scale) / 2),
          .top = std::floor(area.top + (area.height - height * scale) / 2),
          .width = std::floor(width * scale),
          .height = std::floor(height * scale)};
}

/// What is on one side of the split.
struct Side {
  const ScreenPicture* picture;
  const Pane* pane;  ///< null: the reference
  std::string name;
};

Side left_side(const PanelContext& context) {
  const Pane& pane = context.pictures.left();
  return {.picture = pane.picture.get(),
          .pane = &pane,
          .name = short_name(pane.settings.value_or(context.choice.settings))};
}

Side right_side(const PanelContext& context) {
  if (!context.choice.other)
    return {
        .picture = &context.pictures.reference(),
        .pane = nullptr,
        .name = context.pictures.is_reference_current() ? "exact reference" : "exact reference (of an earlier view)"};
  const Pane& pane = context.pictures.right();
  return {
      .picture = pane.picture.get(), .pane = &pane, .name = short_name(pane.settings.value_or(*context.choice.other))};
}

void draw_side(const Side& side, const PanelContext& context, const Area& frame, float from, float to) {
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 low(frame.left, frame.top);
  const ImVec2 high(frame.left + frame.width, frame.top + frame.height);
  list.PushClipRect({from, low.y}, {to, high.y}, true);
  list.AddImage(texture_of(*side.picture), low, high);
  const bool is_laid_over =
      context.choice.overlay != Overlay::none && side.pane != nullptr && !side.pane->overlay_key.empty();
  if (is_laid_over) list.AddImage(texture_of(*side.pane->overlay), low, high);
  const float width = std::max(to - from - 2 * kLabelMargin_px, 60.0F);
  const ImVec2 size = ImGui::CalcTextSize(side.name.c_str(), nullptr, false, width);
  list.AddRectFilled({from, low.y}, {from + size.x + 2 * kLabelMargin_px, low.y + size.y + kLabelMargin_px},
                     IM_COL32(0, 0, 0, 170));
  list.AddText(nullptr, 0, {from + kLabelMargin_px, low.y + kLabelMargin_px / 2}, IM_COL32_WHITE, side.name.c_str(),
               nullptr, width);
  list.PopClipRect();
}

void draw_ramp(ImDrawList& list, const OverlayLegend& legend, ImVec2 at) {
  constexpr float kWidth_px = 22;
  for (std::size_t i = 0; i < legend.ramp.size(); ++i) {
    const float left = at.x + static_cast<float>(i) * kWidth_px;
    list.AddRectFilled({left, at.y}, {left + kWidth_px, at.y + 12}, color_of(legend.ramp[i].color));
    if (i % 2 == 0) list.AddText({left, at.y + 13}, IM_COL32_WHITE, legend.ramp[i].text.c_str());
  }
}

void draw_legend(Overlay overlay, const Area& frame) {
  const OverlayLegend legend = overlay_legend(overlay);
  if (legend.title.empty()) return;
  constexpr float kLine_px = 16;
  const float ramp = legend.ramp.empty() ? 0 : 30;
  const float height = kLine_px + ramp + kLine_px * static_cast<float>(legend.marks.size()) + 8;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const ImVec2 corner(frame.left + 6, frame.top + frame.height - height - 6);
  list.AddRectFilled(corner, {corner.x + 264, corner.y + height}, IM_COL32(0, 0, 0, 190));
  ImVec2 at(corner.x + 6, corner.y + 4);
  list.AddText(at, IM_COL32_WHITE, legend.title.c_str());
  at.y += kLine_px;
  draw_ramp(list, legend, at);
  at.y += ramp;
  for (const LegendEntry& mark : legend.marks) {
    list.AddRectFilled(at, {at.x + 12, at.y + 12}, color_of(mark.color));
    list.AddText({at.x + 18, at.y}, IM_COL32_WHITE, mark.text.c_str());
    at.y += kLine_px;
  }
}

/// Pointer and wheel over the pictures: split, camera.
void steer(const PanelContext& context, const Area& area, const Area& frame, float split_x) {
  ViewChoice& choice = context.choice;
  bool& moves_split = context.state.moves_split;
  ImGui::SetCursorScreenPos({area.left, area.top});
  ImGui::InvisibleButton("pictures", {area.width, area.height},
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  const ImGuiIO& io = ImGui::GetIO();
  const bool is_on_grip = !choice.blinks && std::abs(io.MousePos.x - split_x) <= kGrip_px;
  if (ImGui::IsItemActivated()) moves_split = is_on_grip && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  if (ImGui::IsItemHovered() && is_on_grip) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  Scene& scene = choice.spec.scene;
  if (ImGui::IsItemHovered() && io.MouseWheel != 0) zoom(scene, static_cast<double>(io.MouseWheel));
  if (!ImGui::IsItemActive()) return;
  if (moves_split) {
    choice.split = std::clamp(static_cast<double>((io.MousePos.x - frame.left) / frame.width), 0.0, 1.0);
  } else if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
    // The relief follows the pointer.
    orbit(scene, -kTurn_deg_per_px * static_cast<double>(io.MouseDelta.x),
          kTurn_deg_per_px * static_cast<double>(io.MouseDelta.y));
  } else if (ImGui::IsMouseDown(ImGuiMouseButton_Right)) {
    const double seen = 2 * scene.view.distance * std::tan(scene.view.fov_deg * std::numbers::pi / 360);
    pan(scene, -seen * static_cast<double>(io.MouseDelta.x / frame.height));
  }
}

}  // namespace

void draw_pictures(const PanelContext& context, const Area& area) {
  ViewChoice& choice = context.choice;
  const Side left = left_side(context);
  const Side right = right_side(context);
  const Area frame = fitted_into(area, *left.picture);
  const float end = frame.left + frame.width;
  float split = std::round(frame.left + static_cast<float>(choice.split) * frame.width);
  if (choice.blinks) split = std::fmod(ImGui::GetTime(), 2 * kBlink_s) < kBlink_s ? end : frame.left;
  draw_side(left, context, frame, frame.left, split);
  draw_side(right, context, frame, split, end);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  if (!choice.blinks) list.AddLine({split, frame.top}, {split, frame.top + frame.height}, IM_COL32(255, 255, 255, 200));
  draw_legend(choice.overlay, frame);
  if (const std::string& failure = left.pane->failure; !failure.empty())
    list.AddText(nullptr, 0, {frame.left + 8, frame.top + 28}, IM_COL32(255, 110, 100, 255), failure.c_str(), nullptr,
                 frame.width - 16);
  steer(context, area, frame, split);
}

}  // namespace reliefbench
