#include "reports/viewer/view_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "reports/viewer/view_script.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr float kWidth_px = 190;
const ImVec4 kGood(0.45F, 0.85F, 0.5F, 1);
const ImVec4 kBad(1, 0.45F, 0.4F, 1);
const ImVec4 kDim(0.62F, 0.64F, 0.68F, 1);

void text(const std::string& words) { ImGui::TextUnformatted(words.c_str()); }
void wrapped(const ImVec4& color, const std::string& words) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextWrapped("%s", words.c_str());
  ImGui::PopStyleColor();
}

bool section(ViewChoice& choice, Section which) {
  const std::string label(kSections.at(static_cast<std::size_t>(which)).label);
  ImGui::SetNextItemOpen(choice.is_open(which));
  choice.is_open(which) = ImGui::CollapsingHeader(label.c_str());
  return choice.is_open(which);
}

void draw_setting(const PanelContext& context) {
  draw_settings(context.choice.settings, context.state.edited, "setting");
  const Pane& pane = context.pictures.left();
  if (!pane.failure.empty()) return wrapped(kBad, pane.failure);
  if (context.pictures.is_compiling()) return wrapped(kDim, "compiling...");
  wrapped(kDim, fmt::format("guarantees: {}", guarantee_id(guarantee_of(context.choice.settings))));
}

void draw_compare(const PanelContext& context) {
  ViewChoice& choice = context.choice;
  text("right of the split:");
  ImGui::SameLine();
  if (ImGui::RadioButton("reference", !choice.other)) choice.other.reset();
  ImGui::SameLine();
  if (ImGui::RadioButton("setting", choice.other.has_value()) && !choice.other) choice.other = choice.settings;
  if (choice.other) {
    draw_settings(*choice.other, context.state.edited_other, "other");
    if (ImGui::Button("swap")) std::swap(choice.settings, *choice.other);
    if (const std::string& failure = context.pictures.right().failure; !failure.empty()) wrapped(kBad, failure);
  }
  auto split = static_cast<float>(choice.split);
  ImGui::SetNextItemWidth(kWidth_px);
  if (ImGui::SliderFloat("split", &split, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp))
    choice.split = static_cast<double>(split);
  ImGui::SameLine();
  ImGui::Checkbox("blink", &choice.blinks);
  ImGui::SetNextItemWidth(kWidth_px);
  const std::string now(kOverlays.at(static_cast<std::size_t>(choice.overlay)).id);
  if (!ImGui::BeginCombo("overlay", now.c_str())) return;
  for (std::size_t i = 0; i < kOverlays.size(); ++i) {
    const std::string id(kOverlays.at(i).id);
    if (ImGui::Selectable(id.c_str(), id == now)) choice.overlay = static_cast<Overlay>(i);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", std::string(kOverlays.at(i).description).c_str());
  }
  ImGui::EndCombo();
}

bool is_of_panel(const MetricRow& metric) {
  return metric.part.empty() || metric.part == "mean" || metric.part == "p99" || metric.part == "max";
}

void draw_errors(const PanelContext& context) {
  const Pane& left = context.pictures.left();
  const bool has_other = context.choice.other.has_value();
  const Pane& right = context.pictures.right();
  if (!left.score) return wrapped(kDim, "being computed");
  if (!ImGui::BeginTable("errors", has_other ? 3 : 2, ImGuiTableFlags_RowBg)) return;
  const auto number = [](const Pane& pane, const MetricRow& metric) {
    const std::optional<double> value = pane.score ? metric.value(*pane.score) : std::nullopt;
    const std::string words = value ? fmt::format("{:.4g}", *value) : "-";
    pane.is_judged() ? text(words) : ImGui::TextColored(kDim, "%s", words.c_str());
  };
  if (has_other)
    for (const char* title : {"", "left", "right"}) {
      ImGui::TableNextColumn();
      ImGui::TextColored(kDim, "%s", title);
    }
  for (const MetricRow& metric : metrics()) {
    const bool is_known = metric.value(*left.score) || (has_other && right.score && metric.value(*right.score));
    if (!is_known || !is_of_panel(metric)) continue;
    ImGui::TableNextColumn();
    text(std::string(metric.id));
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", std::string(metric.description).c_str());
    ImGui::SameLine();
    ImGui::TextColored(kDim, "%s", std::string(metric.unit).c_str());
    ImGui::TableNextColumn();
    number(left, metric);
    if (!has_other) continue;
    ImGui::TableNextColumn();
    number(right, metric);
  }
  ImGui::EndTable();
  if (!left.is_judged()) ImGui::TextColored(kDim, "of an earlier view; being computed");
}

void draw_times(const PanelContext& context) {
  const LivePictures& pictures = context.pictures;
  std::vector<float> times_ms;
  for (const double ns : pictures.times_ns()) times_ms.push_back(static_cast<float>(ns * 1e-6));
  if (!times_ms.empty()) {
    const float high = *std::ranges::max_element(times_ms) * 1.2F;
    const std::string words = fmt::format("{:.3g} ms, median of {}: {:.3g} ms", times_ms.back(), times_ms.size(),
                                          median(pictures.times_ns()) * 1e-6);
    ImGui::PlotLines("##times", times_ms.data(), static_cast<int>(times_ms.size()), 0, words.c_str(), 0, high,
                     {ImGui::GetContentRegionAvail().x, 64});
  }
  if (!pictures.is_audited()) return wrapped(kDim, "auditing timers...");
  const TimerAudit& audit = pictures.audit();
  wrapped(audit.valid ? kGood : kBad,
          audit.valid
              ? fmt::format("{}: audited, {:.2f} of the wall clock, {:.2f} for twice the work", timer_id(audit.timer),
                            audit.wall_ratio, audit.doubling)
              : fmt::format("times are not valid: {} failed its audit: {}", timer_id(audit.timer), audit.reason));
  const DeviceInfo& device = pictures.device();
  wrapped(kDim, fmt::format("{}: {}{}", device.backend, device.name,
                            device.software ? "; a software rasteriser: the processor's time" : ""));
  ImGui::Checkbox("draw all the time", &context.state.times_always);
}

void draw_scene(const PanelContext& context) {
  Scene& scene = context.choice.spec.scene;
  for (const View& view : view_presets()) {
    if (&view != view_presets().data()) ImGui::SameLine();
    if (ImGui::SmallButton(view.id.c_str())) scene.view = view;
  }
  for (const Knob& knob : knobs()) {
    const std::string label(knob.label);
    const std::string format = fmt::format("%.3g {}", knob.unit);
    double& value = knob.in(scene);
    ImGui::SetNextItemWidth(kWidth_px);
    ImGui::SliderScalar(label.c_str(), ImGuiDataType_Double, &value, &knob.low, &knob.high, format.c_str(),
                        ImGuiSliderFlags_AlwaysClamp | (knob.is_logarithmic ? ImGuiSliderFlags_Logarithmic : 0));
  }
  wrapped(kDim, fmt::format("{}, {} x {} px, wrap {}", heightmap_name(context.choice.spec.heightmap), scene.width_px,
                            scene.height_px, wrap_id(scene.wrap)));
}

void draw_buttons(const PanelContext& context, PanelWishes& wishes) {
  if (ImGui::Button("screenshot")) wishes.screenshot = true;
  ImGui::SameLine();
  text("copy as");
  for (const std::string_view kind : copied_kinds()) {
    ImGui::SameLine();
    if (ImGui::Button(std::string(kind).c_str())) wishes.copied = kind;
  }
  if (!context.state.notice.empty()) wrapped(kDim, context.state.notice);
  wrapped(kDim, "h: help");
}

void draw_panel(const PanelContext& context, const Area& area, PanelWishes& wishes) {
  ImGui::SetNextWindowPos({area.left, area.top});
  ImGui::SetNextWindowSize({area.width, area.height});
  ImGui::Begin("panel", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_AlwaysVerticalScrollbar);
  ViewChoice& choice = context.choice;
  const bool has_picks = !context.picks.levels.empty() || !context.picks.points.empty();
  if (section(choice, Section::setting)) draw_setting(context);
  if (has_picks && section(choice, Section::picks)) draw_picks(context);
  if (section(choice, Section::compare)) draw_compare(context);
  if (section(choice, Section::error)) draw_errors(context);
  if (section(choice, Section::times)) draw_times(context);
  if (section(choice, Section::scene)) draw_scene(context);
  ImGui::Separator();
  draw_buttons(context, wishes);
  ImGui::End();
}

void step_level(const PanelContext& context, int step) {
  const std::vector<ViewPick>& levels = context.picks.levels;
  const auto now = std::ranges::find(levels, context.choice.settings, &ViewPick::settings);
  const std::ptrdiff_t place = (now == levels.end() ? 0 : now - levels.begin()) + step;
  if (place >= 0 && place < std::ssize(levels))
    context.choice.settings = levels[static_cast<std::size_t>(place)].settings;
}

void take_keys(const PanelContext& context, PanelWishes& wishes) {
  ViewChoice& choice = context.choice;
  const ImGuiIO& io = ImGui::GetIO();
  if (io.WantTextInput) return;
  for (const ImWchar key : io.InputQueueCharacters) {
    if (key == 'h') choice.shows_help = !choice.shows_help;
    if (key == 'b') choice.blinks = !choice.blinks;
    if (key == 's') wishes.screenshot = true;
    if (key == 'r') choice.spec.scene.view = context.state.home;
  }
  const auto is_pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)); };
  if (is_pressed(ImGuiKey_Tab))
    choice.overlay = static_cast<Overlay>((static_cast<std::size_t>(choice.overlay) + 1) % kOverlays.size());
  if (is_pressed(ImGuiKey_RightArrow)) step_level(context, 1);
  if (is_pressed(ImGuiKey_LeftArrow)) step_level(context, -1);
  if (is_pressed(ImGuiKey_Escape)) wishes.close = true;
}

}  // namespace

void draw_help(ViewChoice& choice) {
  constexpr std::array<std::pair<const char*, const char*>, 12> kHelp = {
      {{"left button", "turn the relief; on the line: move the split"},
       {"right button", "pan along u"},
       {"wheel", "come nearer"},
       {"Tab", "next overlay: error, missed, taps, none"},
       {"b", "blink: both pictures in turns"},
       {"left, right", "quality level of the presets"},
       {"r", "the first view again"},
       {"s", "save the window as view_1.png, view_2.png, ..."},
       {"h", "this help"},
       {"Esc", "close"},
       {"Ctrl + click", "type a slider's value"},
       {"grey numbers", "of an earlier view; new ones are on their way"}}};
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({(size.x - kPanelWidth_px) / 2, size.y / 2}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::Begin("Help", &choice.shows_help,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings);
  if (ImGui::BeginTable("help", 2, ImGuiTableFlags_SizingFixedFit)) {
    for (const auto& [key, meaning] : kHelp) {
      ImGui::TableNextColumn();
      ImGui::TextColored(kGood, "%s", key);
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(meaning);
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

PanelWishes draw_view(const PanelContext& context) {
  PanelWishes wishes;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const Area pictures{.left = 0, .top = 0, .width = std::max(size.x - kPanelWidth_px, 1.0F), .height = size.y};
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize({pictures.width, pictures.height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::Begin("pictures", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus |
                   ImGuiWindowFlags_NoScrollWithMouse);
  draw_pictures(context, pictures);
  ImGui::End();
  ImGui::PopStyleVar();
  draw_panel(context, {.left = pictures.width, .top = 0, .width = static_cast<float>(kPanelWidth_px), .height = size.y},
             wishes);
  if (context.choice.shows_help) draw_help(context.choice);
  take_keys(context, wishes);
  return wishes;
}

}  // namespace reliefbench
