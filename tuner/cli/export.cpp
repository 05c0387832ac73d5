#include "reports/export/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "reports/export/container.h"
#include "reports/export/language.h"
#include "reports/export/shipped_shader.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/scene_choice.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

struct ExportArguments {
  SettingArguments setting;
  ExportChoice choice;
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
  if (now.base != before.base) list.push_back(fmt::format("at base {}", before.base));
  if (now.wrap != before.wrap) list.emplace_back(before.wrap == Wrap::clamp ? "with clamp" : "with repeat");
  return list;
}

/// Ids with "all" put in full.
template <typename Rows>
std::vector<std::string> spelt_out(const std::vector<std::string>& ids, const Rows& rows) {
  std::vector<std::string> all;
  for (const std::string& id : ids) {
    if (id == "all") {
      for (const auto& row : rows) all.emplace_back(row.id);
    } else {
      all.push_back(id);
    }
  }
  std::vector<std::string> once;
  for (const std::string& id : all)
    if (std::ranges::find(once, id) == once.end()) once.push_back(id);
  return once;
}

/// What was asked for, by rows that there are.
ExportChoice checked(ExportChoice choice) {
  choice.leaves_out = std::ranges::find(choice.engines, "all") != choice.engines.end();
  choice.engines = spelt_out(choice.engines, engines());
  choice.languages = spelt_out(choice.languages, languages());
  for (const std::string& id : choice.engines) (void)find_engine(id);
  for (const std::string& id : choice.languages) (void)find_language(id);
  if (!choice.container.empty()) (void)find_container(choice.container);
  return choice;
}

/// Where the measured sampler is finer than what ships allows for.
void warn_of_sampler(const nlohmann::json& evidence) {
  const double allowed = kShippedSampler.error.shift;
  if (!evidence.contains("sampler_shift") || evidence["sampler_shift"] >= allowed) return;
  print_warning(fmt::format(
      "measured with a sampler that is off by 1/{:.0f} texel at most; what ships allows for 1/{:.0f} and so "
      "steps shorter: it may take longer and err more",
      1 / evidence["sampler_shift"].get<double>(), 1 / allowed));
}

/// Of one or more, with commas between them.
void make_list(CLI::Option* option) { take_each(option)->delimiter(',')->type_name("ID,..."); }

Export export_of(const SettingArguments& arguments, ExportJob& job) {
  const ChosenSetting chosen = choose_setting(arguments, "export");
  Heightmaps heightmaps;
  const ChosenScene scene = choose_scene(arguments, chosen, heightmaps, false, "export");
  job = {.heightmap = scene.spec.heightmap,
         .settings = chosen.settings,
         .wrap = scene.spec.scene.wrap,
         .relief_depth = scene.spec.scene.relief_depth,
         .base = scene.spec.scene.base,
         .evidence = chosen.evidence,
         .choice = std::move(job.choice)};
  if (scene.measured) job.scene = scene.spec;
  if (!job.evidence.is_null()) job.evidence["same_scene"] = scene.is_same;
  const LoadedHeights& heights = heightmaps.read(scene.spec.heightmap);
  print_reading(heights.reading);
  warn_of_holes(job.settings, job.heightmap);
  const auto other = differences(scene, heights.sha256);
  if (!other.empty())
    print_warning(
        fmt::format("the setting was measured {}: its figures are not those of what ships", fmt::join(other, " and ")));
  warn_of_sampler(job.evidence);
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
  ExportJob job{.heightmap = {}, .settings = Settings(techniques().front()), .choice = checked(arguments.choice)};
  const Export exported = export_of(arguments.setting, job);
  write_export(exported, arguments.output);
  for (const std::string& why : exported.left_out) print_error("left out: " + why);
  if (arguments.json)
    fmt::print("{}", exported.files.back().bytes);
  else
    print_export(job, exported, arguments.output);
}

}  // namespace

void add_export_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command =
      app.add_subcommand("export", "what ships: textures, shaders, the settings, for an engine or none");
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::Option* presets = add_setting_options(*command, arguments->setting);
  command->add_option("--backend", arguments->setting.choice.backend, "whose presets: opengl | vulkan")->needs(presets);
  make_list(command->add_option("--for", arguments->choice.engines,
                                "engines of `reliefbench list engines`, a folder each, or all that can have it; "
                                "default: plain, no engine"));
  make_list(
      command->add_option("--language", arguments->choice.languages,
                          fmt::format("of plain: {} | all; default: glsl", fmt::join(ids_of(languages()), " | "))));
  command
      ->add_option(
          "--textures", arguments->choice.container,
          fmt::format("{}; default: what the engine takes without loss", fmt::join(ids_of(containers()), " | ")))
      ->type_name("ID");
  command->add_flag("--normal-map", arguments->choice.normal_map, "a normal map, too");
  command->add_option("-o,--output", arguments->output, "folder; files of an earlier export there are replaced")
      ->required();
  command->add_flag("--json", arguments->json, "settings.json on standard output");
  command->footer(
      "Writes the map's textures, relief_trace() as shader text, settings.json and a README.md that says what to do "
      "with\nthem; none needs reliefbench.\n"
      "Heightmap, wrap and relief depth are those that the setting was measured with; another heightmap is refused.\n"
      "Examples:\n"
      "  reliefbench export --presets presets.json --quality 50 --backend vulkan -o shipped\n"
      "  reliefbench export --presets presets.json --quality 50 --for unreal,godot -o shipped\n"
      "  reliefbench export --tune out/tune --for three -o shipped\n"
      "  reliefbench export --run out/tune --case 'relief@rocks/grazing?...' -o shipped\n"
      "  reliefbench export rocks --case 'relief?linear_steps=32&format=r16' -o shipped");
  command->callback([arguments] { export_command(*arguments); });
}

}  // namespace reliefbench
