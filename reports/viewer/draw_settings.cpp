// Controls from the registry's rows: a technique, parameter or feature that is new there needs nothing here.
#include <imgui.h>

#include <algorithm>
#include <string>

#include "reports/viewer/view_panel.h"

namespace reliefbench {
namespace {

constexpr float kControlWidth_px = 190;

std::string label_of(std::string_view id) {
  std::string label(id);
  std::ranges::replace(label, '_', ' ');
  return label;
}

void explain(std::string_view words) {
  if (!ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(320);
  ImGui::TextUnformatted(words.data(), words.data() + words.size());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

bool choose_among(const Param& param, int& value) {
  const std::string label = label_of(param.id);
  const std::string now(param.choices.at(static_cast<std::size_t>(value)));
  bool is_changed = false;
  ImGui::SetNextItemWidth(kControlWidth_px);
  if (ImGui::BeginCombo(label.c_str(), now.c_str())) {
    for (int i = 0; i < static_cast<int>(param.choices.size()); ++i) {
      const std::string choice(param.choices.at(static_cast<std::size_t>(i)));
      if (!ImGui::Selectable(choice.c_str(), i == value)) continue;
      value = i;
      is_changed = true;
    }
    ImGui::EndCombo();
  }
  return is_changed;
}

bool choose_number(const Param& param, int& value) {
  const std::string label = label_of(param.id);
  ImGui::SetNextItemWidth(kControlWidth_px);
  ImGuiSliderFlags flags = ImGuiSliderFlags_AlwaysClamp;
  if (param.max - param.min > 64) flags |= ImGuiSliderFlags_Logarithmic;
  return ImGui::SliderInt(label.c_str(), &value, param.min, param.max, "%d", flags);
}

void choose_technique(Settings& settings) {
  const std::string now(settings.technique().id);
  ImGui::SetNextItemWidth(kControlWidth_px);
  const bool is_open = ImGui::BeginCombo("technique", now.c_str(), ImGuiComboFlags_HeightLarge);
  if (!is_open) explain(settings.technique().description);
  if (!is_open) return;
  for (const Technique& technique : techniques()) {
    const std::string id(technique.id);
    const bool is_it = &technique == &settings.technique();
    if (ImGui::Selectable(id.c_str(), is_it) && !is_it) settings = with_technique(settings, technique);
    explain(technique.description);
  }
  ImGui::EndCombo();
}

}  // namespace

void draw_settings(Settings& settings, std::optional<Settings>& edited, const char* id) {
  ImGui::PushID(id);
  choose_technique(settings);
  if (edited && &edited->technique() != &settings.technique()) edited.reset();
  Settings shown = edited.value_or(settings);
  bool is_held = false;
  for (const auto& [param, now] : shown.values()) {
    int value = now;
    const bool is_changed = param.choices.empty() ? choose_number(param, value) : choose_among(param, value);
    is_held = is_held || (param.choices.empty() && ImGui::IsItemActive());
    explain(param.description);
    if (is_changed) shown.set(param.id, value);
  }
  // A count of steps is another pipeline: it is compiled when the slider is let go.
  if (is_held) {
    edited = shown;
  } else {
    settings = shown;
    edited.reset();
  }
  ImGui::PopID();
}

}  // namespace reliefbench
