#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "backends/backend.h"
#include "backends/worker/remote.h"
#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "reports/viewer/live_view.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/scene_choice.h"
#include "tuner/cli/view_start.h"
#include "tuner/measure/viewer.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

constexpr int kFrameSide_px = 512;  // where nothing says how large

struct Arguments {
  SettingArguments setting;
  int device = 0;
  std::string png;
  std::string script;
  int frames = 0;
  bool debug = false;
};

SceneSpec scene_of(const SettingArguments& arguments, const ChosenSetting& chosen, Heightmaps& heightmaps) {
  SettingArguments whole = arguments;
  const bool is_known = !chosen.scenes.empty();  // then the evidence says how large
  if (!is_known && whole.size_px.empty()) whole.size_px = {kFrameSide_px, kFrameSide_px};
  if (!is_known && chosen.scene_id.empty() && !whole.view) whole.view = "oblique";
  return choose_scene(whole, chosen, heightmaps, true, "view").spec;
}

class ViewCommand {
 public:
  explicit ViewCommand(Arguments& arguments)
      : arguments_(arguments),
        start_(view_start(arguments.setting, !arguments.png.empty())),
        spec_(scene_of(arguments.setting, start_.chosen, heightmaps_)) {
    print_reading(heightmaps_.read(spec_.heightmap).reading);
    warn_of_holes(start_.chosen.settings, spec_.heightmap);
  }

  void run() { arguments_.png.empty() ? show() : write(); }

 private:
  [[nodiscard]] const BackendRow& backend() const {
    const std::string& asked = arguments_.setting.choice.backend;
    if (!asked.empty()) return find_backend(asked);
    return find_backend(start_.chosen.backend.empty() ? "opengl" : start_.chosen.backend);
  }

  void write() {
    Viewer viewer(backend(), arguments_.device, spec_, std::move(heightmaps_), open_isolated);
    viewer.choose(start_.chosen.settings);
    const ViewedFrame frame = viewer.draw(spec_.scene.view);
    write_png(arguments_.png, spec_.scene.width_px, spec_.scene.height_px, frame.rgba8);
    const FrameScore& score = frame.judged.score;
    put("{}: e_xy.p99 {} texels, missed_rate {}; written: {}\n", named(start_.chosen.settings),
        format_number(score.at("e_xy.p99")), format_number(score.at("missed_rate")), arguments_.png);
  }

  void show() {
    LiveViewOptions options{.row = &backend(),
                            .device = arguments_.device,
                            .debug = arguments_.debug,
                            .choice = {.settings = start_.chosen.settings, .spec = spec_},
                            .picks = start_.picks,
                            .has_script = !arguments_.script.empty() || arguments_.frames > 0};
    const std::string text = arguments_.frames > 0       ? fmt::format("turn {}\n", arguments_.frames)
                             : arguments_.script.empty() ? ""
                                                         : read_file(arguments_.script);
    options.script =
        parse_script(text, arguments_.frames > 0 ? "--frames" : arguments_.script, options.choice, options.picks);
    options.heightmaps = std::move(heightmaps_);
    show_live(std::move(options));
  }

  const Arguments& arguments_;
  ViewStart start_;
  Heightmaps heightmaps_;
  const SceneSpec spec_;
};

std::string footer() {
  std::string text =
      "In the window: the panel has all there is; `h` shows the keys.\n"
      "A script has a line for each step, '#' begins a comment:\n";
  for (const VerbRow& row : verbs())
    text += fmt::format("  {:<30} {}\n", fmt::format("{} {}", row.id, row.arguments), row.description);
  return text +
         "Examples:\n"
         "  reliefbench view rocks\n"
         "  reliefbench view out/quickstart --scene rocks/grazing --backend vulkan\n"
         "  reliefbench view --presets presets.json --quality 50 --backend vulkan\n"
         "  reliefbench view rocks --script tests/view/tour.txt\n"
         "  reliefbench view rocks --case 'relief?linear_steps=32' --view grazing --png rocks.png";
}

}  // namespace

void add_view_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("view", "a setting live in a window beside the reference, or as a picture");
  const auto arguments = std::make_shared<Arguments>();
  add_setting_options(*command, arguments->setting);
  command->get_option("HEIGHTMAP")
      ->description(
          "a file, a name of `reliefbench list heightmaps`, or the folder of a run or tune, whose front is then at "
          "hand; "
          "default: the heightmap of the presets or the case");
  command->add_option("--backend", arguments->setting.choice.backend,
                      "opengl | vulkan: what draws, and whose presets or front; default: the presets' or the run's "
                      "own, else opengl");
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
      ->check(above_zero());
  command->add_option("--size-px", arguments->setting.size_px, "of the frame; default: as measured, else 512,512")
      ->type_name("W,H")
      ->delimiter(',')
      ->expected(2)
      ->allow_extra_args(false)
      ->check(CLI::Range(1, kFrameSideMax_px));
  CLI::Option* png = command->add_option("--png", arguments->png, "write the frame there instead of opening a window")
                         ->type_name("FILE");
  CLI::Option* script =
      command->add_option("--script", arguments->script, "do what the file says, then close")->type_name("FILE");
  script->excludes(png);
  command->add_option("--frames", arguments->frames, "turn the relief for so many frames, say how fast, and close")
      ->check(above_zero())
      ->excludes(png)
      ->excludes(script);
  command->add_flag("--debug", arguments->debug,
                    "with Vulkan's validation layer or OpenGL's debug output; what they say is an error");
  command->footer(footer());
  command->callback([arguments] { ViewCommand(*arguments).run(); });
}

}  // namespace reliefbench
