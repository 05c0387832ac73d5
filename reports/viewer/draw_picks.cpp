// What can be picked whole: quality levels of presets, and points of a run's front in a small plot.
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reports/viewer/view_panel.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr float kPlotHeight_px = 120;
constexpr float kPlotMargin_px = 14;

void draw_levels(const PanelContext& context) {
  const std::vector<ViewPick>& levels = context.picks.levels;
  const auto now = std::ranges::find(levels, context.choice.settings, &ViewPick::settings);
  const std::string label = now == levels.end() ? "none of them" : now->label;
  ImGui::SetNextItemWidth(190);
  if (!ImGui::BeginCombo("quality level", label.c_str())) return;
  for (const ViewPick& level : levels)
    if (ImGui::Selectable(level.label.c_str(), level.label == label)) context.choice.settings = level.settings;
  ImGui::EndCombo();
}

/// From the least to the greatest value, logarithmic; an error of 0 stands at the least one above it.
struct LogAxis {
  double low = std::numeric_limits<double>::infinity();
  double high = 0;

  void take(double value) {
    if (!(value > 0)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// 0 to 1
  [[nodiscard]] float place(double value) const {
    if (!(high > low)) return 0.5F;
    return static_cast<float>(std::log(std::max(value, low) / low) / std::log(high / low));
  }
};

void draw_points(const PanelContext& context) {
  const std::vector<ViewPick>& points = context.picks.points;
  ImGui::TextDisabled("%s over frame time, both logarithmic", context.picks.error_metric.c_str());
  const float width = ImGui::GetContentRegionAvail().x;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton("front", {width, kPlotHeight_px});
  const bool is_hovered = ImGui::IsItemHovered();
  const bool is_clicked = ImGui::IsItemClicked();
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(corner, {corner.x + width, corner.y + kPlotHeight_px}, IM_COL32(20, 22, 28, 255));
  LogAxis time;
  LogAxis error;
  for (const ViewPick& point : points) {
    time.take(point.time_ns);
    error.take(point.error);
  }
  const ViewPick* nearest = nullptr;
  float distance = 12;
  std::vector<ImVec2> places;
  for (const ViewPick& point : points) {
    places.emplace_back(
        corner.x + kPlotMargin_px + time.place(point.time_ns) * (width - 2 * kPlotMargin_px),
        corner.y + kPlotHeight_px - kPlotMargin_px - error.place(point.error) * (kPlotHeight_px - 2 * kPlotMargin_px));
    const float away =
        std::hypot(ImGui::GetIO().MousePos.x - places.back().x, ImGui::GetIO().MousePos.y - places.back().y);
    if (!is_hovered || away > distance) continue;
    nearest = &point;
    distance = away;
  }
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {  // the front is a step line
    const ImVec2 corner_of_step(places[i + 1].x, places[i].y);
    list.AddLine(places[i], corner_of_step, IM_COL32(110, 130, 160, 255));
    list.AddLine(corner_of_step, places[i + 1], IM_COL32(110, 130, 160, 255));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_chosen = points[i].settings == context.choice.settings;
    list.AddCircleFilled(places[i], is_chosen ? 6.0F : 4.0F,
                         is_chosen ? IM_COL32(255, 190, 60, 255) : IM_COL32(120, 190, 255, 255), 16);
  }
  const auto label = [&](const ViewPick& point) {
    return fmt::format("{}: {:.3g} ms, {} {:.3g}", point.label, point.time_ns * 1e-6, context.picks.error_metric,
                       point.error);
  };
  if (nearest != nullptr) ImGui::SetTooltip("%s", label(*nearest).c_str());
  if (nearest != nullptr && is_clicked) context.choice.settings = nearest->settings;
  const auto now = std::ranges::find(points, context.choice.settings, &ViewPick::settings);
  ImGui::TextWrapped("%s", now == points.end() ? "not on the front" : label(*now).c_str());
}

}  // namespace

void draw_picks(const PanelContext& context) {
  if (!context.picks.levels.empty()) draw_levels(context);
  if (!context.picks.points.empty()) draw_points(context);
}

}  // namespace reliefbench
