#include "reports/export/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/setting_options.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

struct Arguments {
  SettingArguments setting;
  std::string output;
  bool json = false;
};

ExportJob job_of(const SettingArguments& arguments) {
  const ChosenSetting chosen = choose_setting(arguments, "export");
  ExportJob job{.heightmap = heightmap_of(arguments),
                .settings = chosen.settings,
                .wrap = wrap_of(arguments),
                .relief_depth = arguments.relief_depth};
  if (!chosen.levels.empty()) {
    job.evidence = chosen.levels.at(static_cast<std::size_t>(chosen.level)).evidence;
    job.evidence["presets"] = arguments.presets;
  }
  return job;
}

void print_export(const ExportJob& job, const Export& exported, const std::string& folder) {
  fmt::print("{}\n", paint_for_stdout().bold(setting_id(job.settings)));
  const nlohmann::json& evidence = job.evidence;
  for (const nlohmann::json& scene : evidence.is_null() ? nlohmann::json::array() : evidence.at("scenes"))
    fmt::print("  measured in {}: {}, {} {}\n", scene.at("scene").get<std::string>(),
               format_time_ns(scene.at("time_ns")), evidence.value("error_metric", "error"),
               format_number(scene.at("error")));
  std::vector<std::vector<std::string>> rows;
  for (const ExportedFile& file : exported.files)
    rows.push_back({file.name, format_bytes(static_cast<std::int64_t>(file.bytes.size())), file.what});
  fmt::print("\n{}\nwritten: {}\n", columns(rows, "  "), folder);
}

void run(const Arguments& arguments) {
  const ExportJob job = job_of(arguments.setting);
  const Export exported = make_export(job);
  write_export(exported, arguments.output);
  if (arguments.json)
    fmt::print("{}", exported.files.back().bytes);
  else
    print_export(job, exported, arguments.output);
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("export", "what ships: textures, one shader file, the settings");
  const auto arguments = std::make_shared<Arguments>();
  CLI::Option* presets = add_setting_options(*command, arguments->setting);
  command->add_option("--backend", arguments->setting.choice.backend, "whose presets: opengl | vulkan")->needs(presets);
  command->add_option("-o,--output", arguments->output, "folder; files of an earlier export there are replaced")
      ->required();
  command->add_flag("--json", arguments->json, "settings.json on standard output");
  command->footer(
      "Writes the map's textures as KTX2, relief.glsl with the trace and settings.json; none of them needs "
      "reliefbench.\n"
      "Examples:\n"
      "  reliefbench export rocks --presets presets.json --quality 50 --backend vulkan -o shipped\n"
      "  reliefbench export rocks --case 'relief?linear_steps=32&format=r16' -o shipped");
  command->callback([=, &exit_code] {
    run(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
