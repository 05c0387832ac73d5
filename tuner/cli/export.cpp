#include "reports/export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "kernels/error.h"
#include "tuner/append_file.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/presets.h"
#include "tuner/setting_space.h"

namespace reliefbench {
namespace {

struct Arguments {
  std::string heightmap;
  std::string presets;
  PresetChoice choice;
  std::string case_id;
  std::string wrap = "repeat";
  double relief_depth = Scene{}.relief_depth;
  std::string size;
  std::uint32_t seed = 1;
  std::string output;
  bool json = false;
};

ExportJob job_of(const Arguments& arguments) {
  ExportJob job{.heightmap = {.source = arguments.heightmap, .seed = arguments.seed},
                .settings = Settings(techniques().front()),
                .wrap = arguments.wrap == "clamp" ? Wrap::clamp : Wrap::repeat,
                .relief_depth = arguments.relief_depth};
  if (!arguments.size.empty()) set_size(job.heightmap, arguments.size);
  if (!arguments.case_id.empty()) {
    job.settings = parse_setting(arguments.case_id);
    return job;
  }
  const std::vector<LoadedPreset> presets = parse_presets(read_file(arguments.presets), arguments.presets);
  const LoadedPreset& preset = choose_preset(presets, arguments.choice, arguments.presets);
  job.settings = preset.settings;
  job.evidence = preset.evidence;
  job.evidence["presets"] = arguments.presets;
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
  const ExportJob job = job_of(arguments);
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
  command->add_option("HEIGHTMAP", arguments->heightmap, "a file, or a name of `reliefbench list heightmaps`")
      ->required();
  CLI::Option* presets = command->add_option("--presets", arguments->presets, "presets.json; with --quality");
  CLI::Option* quality =
      command->add_option("--quality", arguments->choice.quality, "level of the presets, 0 to 100")->needs(presets);
  presets->needs(quality);
  command->add_option("--backend", arguments->choice.backend, "whose presets: opengl | vulkan")->needs(presets);
  command->add_option("--device-name", arguments->choice.device, "whose presets: glob on the device's name")
      ->type_name("GLOB")
      ->needs(presets);
  CLI::Option* case_id =
      command->add_option("--case", arguments->case_id, "a case's id instead, as `recommend` and `tune` print it")
          ->type_name("ID")
          ->excludes(presets);
  command->add_option("--wrap", arguments->wrap, "repeat | clamp")
      ->check(CLI::IsMember({"repeat", "clamp"}))
      ->capture_default_str();
  command->add_option("--relief-depth", arguments->relief_depth, "in sides of one tile")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--size", arguments->size, "WIDTHxHEIGHT of a procedural heightmap; default: 256x256");
  command->add_option("--seed", arguments->seed, "of a procedural heightmap")->capture_default_str();
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
    if (presets->empty() && case_id->empty()) fail_input("export needs --presets with --quality, or --case");
    run(*arguments);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
