#include "reports/viewer/live_view.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "backends/window/screen.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "reports/viewer/copied_text.h"
#include "reports/viewer/live_pictures.h"
#include "reports/viewer/script_run.h"
#include "reports/viewer/view_panel.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

constexpr double kIdle_s = 0.25;   // between two looks where nothing happens
constexpr double kBusy_s = 0.015;  // ... where the background is at work
constexpr int kSamples = 7;        // of a preset's time
constexpr int kFramesOfEvent = 3;  // that Dear ImGui needs to come to rest

/// The first of view_1.png, view_2.png, ... that is not there yet.
std::filesystem::path free_name() {
  for (int i = 1;; ++i)
    if (std::filesystem::path name = fmt::format("view_{}.png", i); !std::filesystem::exists(name)) return name;
}

void set_style() {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.WindowPadding = {8, 6};
  style.FramePadding = {4, 2};
  style.ItemSpacing = {6, 3};
  for (const ImGuiCol background : {ImGuiCol_WindowBg, ImGuiCol_PopupBg}) style.Colors[background].w = 1;
}

Size window_size(const Scene& scene) {
  return {.width = std::max(scene.width_px, kPicturesLeastWidth_px) + kPanelWidth_px,
          .height = std::max(scene.height_px, kPanelLeastHeight_px)};
}

class LiveView {
 public:
  explicit LiveView(LiveViewOptions options)
      : choice_(std::move(options.choice)),
        picks_(std::move(options.picks)),
        debug_(options.debug),
        window_({.api = window_api(*options.row), .size = window_size(choice_.spec.scene), .debug = options.debug}),
        pictures_(window_, {.row = options.row,
                            .device = options.device,
                            .debug = options.debug,
                            .spec = choice_.spec,
                            .heightmaps = std::move(options.heightmaps)}) {
    state_.home = choice_.spec.scene.view;
    if (!options.has_script) return;
    script_.emplace(std::move(options.script));
    ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NoMouse;  // wherever the pointer may lie
  }

  void run() {
    set_style();
    window_.show();
    while (!window_.is_closed()) {
      window_.take_events(is_minimised() ? kIdle_s : wait_s());
      if (is_minimised()) continue;
      const ScriptRun::Wishes scripted =
          script_ ? script_->step(choice_, picks_, pictures_.is_settled(choice_)) : ScriptRun::Wishes{};
      if (scripted.quit || (script_ && script_->is_over() && scripted.screenshot.empty() && scripted.copied.empty()))
        break;
      if (!frame(scripted)) break;
    }
    window_.hide();
    check_complaints();
    if (pictures_.is_working()) end_at_once();
  }

 private:
  /// How long to wait for something to happen.
  [[nodiscard]] double wait_s() {
    if (script_ || state_.times_always || choice_.blinks || still_ > 0) return 0;
    return pictures_.is_busy() || !pictures_.is_audited() ? kBusy_s : kIdle_s;
  }

  /// A bake may take minutes, and nobody is there any more to see what comes of it. Nothing else ends its thread,
  /// and what it works on must not go before.
  [[noreturn]] static void end_at_once() {
    std::fflush(nullptr);
    std::_Exit(static_cast<int>(Exit::done));
  }

  [[nodiscard]] bool is_minimised() const { return window_.size().width == 0 || window_.size().height == 0; }

  /// returns: whether to go on
  bool frame(const ScriptRun::Wishes& scripted) {
    pictures_.update(choice_);
    if (state_.times_always && pictures_.is_audited()) static_cast<void>(pictures_.time_again(1));
    ImGui::NewFrame();
    const PanelWishes wishes = draw_view({.choice = choice_, .picks = picks_, .pictures = pictures_, .state = state_});
    ImGui::Render();
    const ImGuiIO& io = ImGui::GetIO();
    const bool is_moved = io.MouseDelta.x != 0 || io.MouseDelta.y != 0 || io.MouseWheel != 0 || ImGui::IsAnyMouseDown();
    still_ = is_moved || ImGui::IsAnyItemActive() ? kFramesOfEvent : std::max(0, still_ - 1);
    const bool is_kept = wishes.screenshot || !scripted.screenshot.empty();
    SeenWindow seen;
    pictures_.screen().present(*ImGui::GetDrawData(), is_kept ? &seen : nullptr);
    window_.set_title(fmt::format("{} - {} - reliefbench", short_name(choice_.settings), pictures_.device().backend));
    const bool has_answer = pictures_.left().is_drawn() || !pictures_.left().failure.empty();
    if (!pictures_.is_audited() && has_answer && still_ == 0) pictures_.audit_timers();
    if (!scripted.screenshot.empty()) save(scripted.screenshot, seen);
    if (!scripted.copied.empty()) write_output(scripted.file, copied(scripted.copied));
    if (wishes.screenshot) tell([&] { save(free_name(), seen); });
    if (!wishes.copied.empty())
      tell([&] {
        ImGui::SetClipboardText(copied(wishes.copied).c_str());
        state_.notice = fmt::format("copied as {}", wishes.copied);
      });
    return !wishes.close;
  }

  void save(const std::filesystem::path& name, const SeenWindow& seen) {
    write_png(name, seen.size.width, seen.size.height, seen.rgba8);
    state_.notice = "written: " + name.string();
    fmt::print("{}\n", state_.notice);
  }

  [[nodiscard]] std::string copied(std::string_view kind) {
    const Pane& pane = pictures_.left();
    const DeviceInfo& device = pictures_.device();
    if (kind == "preset" && pictures_.is_audited() && !pictures_.audit().valid)
      fail_environment("a preset has a time, and {} has no valid timer: {}", device.name, pictures_.audit().reason);
    return copied_text(kind, {.choice = &choice_,
                              .heights_sha256 = pictures_.heights().sha256,
                              .backend = device.backend,
                              .device = device.name,
                              .driver = device.driver,
                              .times_ns = kind == "preset" ? pictures_.time_again(kSamples) : std::vector<double>{},
                              .error = pane.score ? pane.score->at("e_xy.p99") : 0});
  }

  /// A full disk does not end the session.
  template <typename Action>
  void tell(const Action& action) {
    try {
      action();
    } catch (const Error& error) {
      state_.notice = error.what();
      print_error(error.what());
    }
  }

  void check_complaints() {
    if (!debug_) return;
    const std::vector<std::string> said = pictures_.complaints();
    if (!said.empty()) fail_environment("the API's debug output said {} things, first: {}", said.size(), said.front());
  }

  ViewChoice choice_;
  ViewPicks picks_;
  bool debug_;
  std::optional<ScriptRun> script_{};
  PanelState state_{};
  int still_ = kFramesOfEvent;
  Window window_;
  LivePictures pictures_;
};

}  // namespace

void show_live(LiveViewOptions options) { LiveView(std::move(options)).run(); }

}  // namespace reliefbench
