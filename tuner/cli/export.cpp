#include "reports/export/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/scene_choice.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

struct ExportArguments {
  SettingArguments setting;
  std::string output;
  bool json = false;
};

/// What ships and is not as it was measured, in words.
std::vector<std::string> differences(const ChosenScene& chosen, const std::string& heights_sha256) {
  std::vector<std::string> list;
  if (!chosen.measured) return list;
  const Scene& before = chosen.measured->spec.scene;
  const Scene& now = chosen.spec.scene;
  if (heights_sha256 != chosen.measured->heights_sha256) list.emplace_back("on another heightmap");
  if (now.relief_depth != before.relief_depth) list.push_back(fmt::format("at relief depth {}", before.relief_depth));
  if (now.wrap != before.wrap) list.emplace_back(before.wrap == Wrap::clamp ? "with clamp" : "with repeat");
  return list;
}

Export export_of(const SettingArguments& arguments, ExportJob& job) {
  const ChosenSetting chosen = choose_setting(arguments, "export");
  Heightmaps heightmaps;
  const ChosenScene scene = choose_scene(arguments, chosen, heightmaps, false, "export");
  job = {.heightmap = scene.spec.heightmap,
         .settings = chosen.settings,
         .wrap = scene.spec.scene.wrap,
         .relief_depth = scene.spec.scene.relief_depth,
         .evidence = chosen.evidence};
  if (scene.measured) job.scene = scene.spec;
  if (!job.evidence.is_null()) job.evidence["same_scene"] = scene.is_same;
  const LoadedHeights& heights = heightmaps.read(scene.spec.heightmap);
  print_reading(heights.reading);
  const auto other = differences(scene, heights.sha256);
  if (!other.empty())
    fmt::print(stderr, "warning: the setting was measured {}: its figures are not those of what ships\n",
               fmt::join(other, " and "));
  return make_export(job, std::move(heightmaps));
}

void print_export(const ExportJob& job, const Export& exported, const std::string& folder) {
  put("{}\n", paint_for_stdout().bold(named(job.settings)));
  const nlohmann::json& evidence = job.evidence;
  for (const nlohmann::json& scene : evidence.is_null() ? nlohmann::json::array() : evidence.at("scenes"))
    put("  measured in {}: {}{}\n", scene.at("scene").get<std::string>(), format_time_ns(scene.at("time_ns")),
        scene.contains("error")
            ? fmt::format(", {} {}", evidence.value("error_metric", "error"), format_number(scene.at("error")))
            : "");
  std::vector<std::vector<std::string>> rows;
  for (const ExportedFile& file : exported.files)
    rows.push_back({file.name, format_bytes(static_cast<std::int64_t>(file.bytes.size())), file.what});
  put("\n{}\nwritten: {}\n", columns(rows, "  "), folder);
}

void export_command(const ExportArguments& arguments) {
  ExportJob job{.heightmap = {}, .settings = Settings(techniques().front())};
  const Export exported = export_of(arguments.setting, job);
  write_export(exported, arguments.output);
  if (arguments.json)
    fmt::print("{}", exported.files.back().bytes);
  else
    print_export(job, exported, arguments.output);
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("export", "what ships: textures, one shader file, the settings");
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::Option* presets = add_setting_options(*command, arguments->setting);
  command->add_option("--backend", arguments->setting.choice.backend, "whose presets: opengl | vulkan")->needs(presets);
  command->add_option("-o,--output", arguments->output, "folder; files of an earlier export there are replaced")
      ->required();
  command->add_flag("--json", arguments->json, "settings.json on standard output");
  command->footer(
      "Writes the map's textures as KTX2, relief.glsl with the trace and settings.json; none of them needs "
      "reliefbench.\n"
      "Heightmap, wrap and relief depth are those that the setting was measured with; another heightmap is refused.\n"
      "Examples:\n"
      "  reliefbench export --presets presets.json --quality 50 --backend vulkan -o shipped\n"
      "  reliefbench export --run out/tune --case 'relief@rocks/grazing?...' -o shipped\n"
      "  reliefbench export rocks --case 'relief?linear_steps=32&format=r16' -o shipped");
  command->callback([=, &exit_code] {
    export_command(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
