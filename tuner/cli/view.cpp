#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "backends/window.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "kernels/judge/heat_map.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/scene_choice.h"
#include "tuner/measure/view_state.h"
#include "tuner/measure/viewer.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr int kFrameSide_px = 512;  // where nothing says how large

struct Arguments {
  SettingArguments setting;
  int device = 0;
  std::string png;
  int frames = 0;
};

/// The first of view_1.png, view_2.png, ... that is not there yet.
std::filesystem::path free_name() {
  for (int i = 1;; ++i)
    if (std::filesystem::path name = fmt::format("view_{}.png", i); !std::filesystem::exists(name)) return name;
}

SceneSpec scene_of(const SettingArguments& arguments, const ChosenSetting& chosen, Heightmaps& heightmaps) {
  SettingArguments whole = arguments;
  const bool is_known = !chosen.scenes.empty();  // then the evidence says how large
  if (!is_known && whole.size_px.empty()) whole.size_px = {kFrameSide_px, kFrameSide_px};
  if (!is_known && chosen.scene_id.empty() && !whole.view) whole.view = "oblique";
  return choose_scene(whole, chosen, heightmaps, true, "view").spec;
}

class ViewCommand {
 public:
  explicit ViewCommand(const Arguments& arguments)
      : arguments_(arguments),
        chosen_(choose_setting(arguments.setting, "view")),
        spec_(scene_of(arguments.setting, chosen_, heightmaps_)) {
    print_reading(heightmaps_.read(spec_.heightmap).reading);
    state_.level = chosen_.level;
    state_.view = scene_.view;
  }

  void run() { arguments_.png.empty() ? show() : write(); }

 private:
  [[nodiscard]] const BackendRow& backend() const {
    const std::string& asked = arguments_.setting.choice.backend;
    if (!asked.empty()) return find_backend(asked);
    return find_backend(chosen_.backend.empty() ? "opengl" : chosen_.backend);
  }
  [[nodiscard]] Viewer open() { return {backend(), arguments_.device, spec_, std::move(heightmaps_)}; }

  void write() {
    Viewer viewer = open();
    viewer.choose(chosen_.settings);
    const ViewedFrame frame = viewer.draw(scene_.view);
    write_png(arguments_.png, scene_.width_px, scene_.height_px, frame.rgba8);
    const FrameScore& score = frame.judged.score;
    put("{}: e_xy.p99 {} texels, missed_rate {}; written: {}\n", named(chosen_.settings),
        format_number(score.at("e_xy.p99")), format_number(score.at("missed_rate")), arguments_.png);
  }

  /// Draws when something changed; to count frames, without waiting for that.
  void show() {
    Window window(scene_.width_px, scene_.height_px);
    Viewer viewer = open();
    viewer.choose(chosen_.settings);
    draw(viewer, window);
    const bool is_counted = arguments_.frames > 0;
    for (int drawn = 1; !is_counted || drawn < arguments_.frames;) {
      const WindowEvents events = is_counted ? window.poll() : window.wait();
      const auto pressed = [&](Key key) { return std::ranges::find(events.keys, key) != events.keys.end(); };
      if (events.is_closed || pressed(Key::escape)) return;
      ViewState next = steer(state_, events, scene_.view, static_cast<int>(chosen_.levels.size()));
      if (next.level != state_.level) {
        chosen_.settings = chosen_.levels.at(static_cast<std::size_t>(next.level)).settings;
        viewer.choose(chosen_.settings);
      }
      const bool is_stale = is_counted || next != state_;
      state_ = std::move(next);
      if (is_stale) {
        draw(viewer, window);
        ++drawn;
      } else if (events.is_exposed) {
        window.show(picture_, scene_.width_px, scene_.height_px);
      }
      if (pressed(Key::s)) save();
    }
  }

  void draw(Viewer& viewer, Window& window) {
    ViewedFrame frame = viewer.draw(state_.view);
    picture_ =
        state_.shows_error ? heat_map(frame.judged.pixels, scene_.width_px, scene_.height_px) : std::move(frame.rgba8);
    window.set_title(title(frame));
    window.show(picture_, scene_.width_px, scene_.height_px);
  }

  [[nodiscard]] std::string title(const ViewedFrame& frame) const {
    std::string text = short_name(chosen_.settings);
    if (!chosen_.levels.empty())
      text += fmt::format(" | level {}", chosen_.levels.at(static_cast<std::size_t>(state_.level)).quality);
    text += fmt::format(" | {} a frame | e_xy.p99 {} texels", format_time_ns(frame.wall_ns),
                        format_number(frame.judged.score.at("e_xy.p99")));
    return state_.shows_error ? text + " | error map" : text;
  }

  /// A full disk does not end the session.
  void save() const {
    try {
      const std::filesystem::path name = free_name();
      write_png(name, scene_.width_px, scene_.height_px, picture_);
      put("written: {}\n", name.string());
    } catch (const Error& error) {
      print_error(error.what());
    }
  }

  const Arguments& arguments_;
  ChosenSetting chosen_;
  Heightmaps heightmaps_;
  const SceneSpec spec_;
  const Scene& scene_ = spec_.scene;
  ViewState state_;
  std::vector<std::uint8_t> picture_;  ///< that the window shows, RGBA8
};

}  // namespace

void add_view_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("view", "one setting in a window, or as a picture");
  const auto arguments = std::make_shared<Arguments>();
  add_setting_options(*command, arguments->setting);
  command->add_option("--backend", arguments->setting.choice.backend,
                      "opengl | vulkan: what draws, and whose presets; default: the presets' own, else opengl");
  command->add_option("--device", arguments->device, "index in `reliefbench devices`")->capture_default_str();
  std::vector<std::string> views;
  for (const View& view : view_presets()) views.push_back(view.id);
  command
      ->add_option("--view", arguments->setting.view,
                   fmt::format("where it starts: {}; default: as measured, as the case says, else oblique",
                               fmt::join(views, " | ")))
      ->check(CLI::IsMember(views));
  command
      ->add_option("--tiling", arguments->setting.tiling,
                   "tiles along a side of the plane; default: as measured, else 1")
      ->check(CLI::PositiveNumber);
  command->add_option("--size-px", arguments->setting.size_px, "of the frame; default: as measured, else 512,512")
      ->type_name("W,H")
      ->delimiter(',')
      ->expected(2)
      ->allow_extra_args(false)
      ->check(CLI::Range(1, kFrameSideMax_px));
  CLI::Option* png = command->add_option("--png", arguments->png, "write the frame there instead of opening a window")
                         ->type_name("FILE");
  command->add_option("--frames", arguments->frames, "close after so many, drawn one after the other")
      ->check(CLI::PositiveNumber)
      ->excludes(png);
  command->footer(
      "In the window:\n"
      "  left button, wheel   turn the relief, come nearer\n"
      "  left, right          quality level of the presets\n"
      "  Tab                  shaded frame or error map, against the exact reference\n"
      "  R                    the first view again\n"
      "  S                    save what is seen as view_1.png, view_2.png, ...\n"
      "  Esc                  close\n"
      "Examples:\n"
      "  reliefbench view --presets presets.json --quality 50 --backend vulkan\n"
      "  reliefbench view rocks --case 'relief?linear_steps=32' --view grazing --png rocks.png");
  command->callback([=, &exit_code] {
    ViewCommand(*arguments).run();
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
