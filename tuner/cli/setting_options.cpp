#include "tuner/cli/setting_options.h"

#include <algorithm>
#include <functional>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "tuner/cli/format.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/device_json.h"
#include "tuner/results/run_question.h"
#include "tuner/results/store.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using nlohmann::json;

ChosenSetting of_presets(const SettingArguments& arguments) {
  ChosenSetting result{.settings = Settings(techniques().front()),
                       .levels = parse_presets(read_file(arguments.presets), arguments.presets)};
  const LoadedPreset chosen = choose_preset(result.levels, arguments.choice, arguments.presets);
  result.settings = chosen.settings;
  result.backend = chosen.backend;
  result.evidence = chosen.evidence;
  result.evidence["presets"] = arguments.presets;
  result.scenes = chosen.scenes;
  std::erase_if(result.levels, [&](const LoadedPreset& preset) {
    return preset.backend != chosen.backend || preset.device != chosen.device;
  });
  std::ranges::sort(result.levels, {}, &LoadedPreset::quality);
  result.level = static_cast<int>(std::ranges::find(result.levels, chosen.quality, &LoadedPreset::quality) -
                                  result.levels.begin());
  return result;
}

json measurement_of(const Record& record, const std::string& error_metric, const CoarseFilter& filter) {
  const Summary& time = record.frame_time->summary;
  json measurement = {{"scene", record.scene},  {"scene_key", record.scene_key.hex}, {"case", record.case_id},
                      {"time_ns", time.median}, {"ci", {time.ci_low, time.ci_high}}, {"samples", time.n}};
  if (const std::optional<double> error = metric_value(record, error_metric)) {
    measurement["error"] = *error;
    measurement["coarse_filter"] = filter.error_of(settings_of(record.technique, record.params));
  }
  return measurement;
}

/// Keeps the records that were measured, if any were, and of these those of the asked backend, if there are any.
std::vector<const Record*> preferred(std::vector<const Record*> records, const std::string& backend) {
  const auto prefer = [&](const std::function<bool(const Record*)>& is_better) {
    if (std::ranges::any_of(records, is_better)) std::erase_if(records, std::not_fn(is_better));
  };
  prefer([](const Record* one) { return one->status == Status::ok; });
  prefer([&](const Record* one) { return one->backend == backend; });
  return records;
}

/// What a device's sampler reads beside its place in the settings' map, in texels, as its audit showed; none: unknown,
/// or they rest on no sampler
std::optional<double> sampler_shift_of(const json& device, const Settings& settings) {
  if (!makes_up_for_filter(settings)) return std::nullopt;
  const std::string_view texels = texel_type_id(storage_of(settings).format.type);
  for (const json& row : device.value("filter", json::array()))
    if (row.value("texels", "") == texels && row.contains("least")) return parse_filter_weights(row).error().shift;
  return std::nullopt;
}

ChosenSetting of_run(const SettingArguments& arguments) {
  const Run run = load_run(arguments.run);
  if (const auto known = scenes_of(run.records); !arguments.scene.empty() && !known.contains(arguments.scene))
    fail_scene(arguments.scene, known, run.folder.string());
  const auto is_it = [&](const Record& candidate) {
    if (!is_setting_key(arguments.case_id)) return candidate.case_id == arguments.case_id;
    return (arguments.scene.empty() || candidate.scene == arguments.scene) &&
           setting_key(settings_of(candidate.technique, candidate.params)) == arguments.case_id;
  };
  std::vector<const Record*> meant;
  for (const Record& candidate : run.records)
    if (is_it(candidate)) meant.push_back(&candidate);
  if (meant.empty()) fail_input("--run {}: has no case '{}'", arguments.run, arguments.case_id);
  meant = preferred(std::move(meant), arguments.choice.backend);
  const Record* const record = meant.front();
  for (const Record* other : meant)
    if (other->scene != record->scene)
      fail_input("--run {}: has '{}' in {} and in {}: choose by --scene", arguments.run, arguments.case_id,
                 record->scene, other->scene);
  if (record->status != Status::ok)
    fail_input("--run {}: case '{}' was not measured: {} {}", arguments.run, arguments.case_id,
               status_id(record->status), record->reason);
  const MeasuredScene* const scene = find_scene(run.scenes, record->scene_key);
  if (scene == nullptr) fail_input("--run {}: does not say what scene '{}' is", arguments.run, record->scene);
  const std::string metric = question_of(run.info).error_metric;
  const CoarseFilter filter(run.info, record->backend);
  ChosenSetting chosen{.settings = settings_of(record->technique, record->params),
                       .backend = record->backend,
                       .scene_id = record->scene,
                       .evidence = {{"run", arguments.run},
                                    {"backend", record->backend},
                                    {"device", record->device},
                                    {"error_metric", metric},
                                    {"scenes", json::array({measurement_of(*record, metric, filter)})}},
                       .scenes = {*scene}};
  if (const auto shift = sampler_shift_of(device_of(run.info, record->backend), chosen.settings))
    chosen.evidence["sampler_shift"] = *shift;
  return chosen;
}

/// The case that a tune run picked, in the first of its scenes unless another is named.
SettingArguments of_tune(SettingArguments arguments) {
  const std::string path = fmt::format("{}/{}", arguments.tune, kTuneFile);
  const json result = read_json(path);
  const auto setting = json::json_pointer("/pick/setting");
  if (!result.is_object() || !result.contains("pick") || !result.contains("scenes"))
    fail_input("{}: not a tune run's result", path);
  if (!result.contains(setting))
    fail_input("{}: has no pick; choose one of its answers by --run {} --case", path, arguments.tune);
  arguments.case_id = setting_key(parse_setting(result.at(setting).get<std::string>()));
  arguments.run = arguments.tune;
  if (arguments.scene.empty()) arguments.scene = result.at("scenes").at(0).get<std::string>();
  return arguments;
}

/// What a key stands for where no run says so.
Settings built_in_setting(const std::string& key) {
  std::vector<Settings> known;
  for (const char* heightmap : {"rocks", "ball"}) {
    const Config space = default_tune_config({.source = heightmap}, {});
    for (const Case& c : make_plan(space, std::vector<std::string>{"null"}, "").cases) known.push_back(c.settings);
  }
  for (const Technique& technique : techniques()) known.emplace_back(technique);
  if (const Settings* found = find_by_key(key, known)) return *found;
  fail_input("--case {}: no setting of the built-in space has this key; --run names the run that printed it", key);
}

}  // namespace

CLI::Option* add_setting_options(CLI::App& command, SettingArguments& arguments) {
  command.add_option("HEIGHTMAP", arguments.heightmap,
                     "a file, or a name of `reliefbench list heightmaps`; default: that of the presets or the case");
  command.add_flag("--other-heightmap", arguments.other_heightmap,
                   "take HEIGHTMAP although the setting was measured on another");
  CLI::Option* presets = command.add_option("--presets", arguments.presets, "presets.json; with --quality");
  CLI::Option* quality =
      command.add_option("--quality", arguments.choice.quality, "level of the presets, 0 to 100")->needs(presets);
  presets->needs(quality);
  command.add_option("--device-name", arguments.choice.device, "whose presets: glob on the device's name")
      ->type_name("GLOB")
      ->needs(presets);
  CLI::Option* of_case =
      command
          .add_option("--case", arguments.case_id,
                      "a case's id instead, or the eight digits of its setting, as `recommend` and `tune` print them")
          ->type_name("ID")
          ->excludes(presets);
  command.add_option("--run", arguments.run, "folder of the run that measured the case, for its whole scene")
      ->type_name("RUN")
      ->needs(of_case);
  command.add_option("--tune", arguments.tune, "folder of a tune run: its pick, with its whole scene")
      ->type_name("DIR")
      ->excludes(presets)
      ->excludes(of_case);
  command.add_option("--scene", arguments.scene, "which of the presets' scenes, e.g. rocks/grazing")->type_name("ID");
  command.add_option("--wrap", arguments.wrap, "repeat | clamp; default: as measured, else repeat")
      ->check(CLI::IsMember({"repeat", "clamp"}));
  command.add_option("--relief-depth", arguments.relief_depth, "in sides of one tile; default: as measured, else 0.1")
      ->check(not_below_zero());
  add_base_option(command, arguments.base, "as measured, else 1");
  add_reading_options(command, arguments.reading);
  return presets;
}

std::string scene_words(const SceneSpec& spec) {
  const HeightmapSpec& heightmap = spec.heightmap;
  const HeightmapSpec usual;
  const Scene& scene = spec.scene;
  std::string words = shell_quoted(heightmap.source);
  if (heightmap.channel != usual.channel) words += " --channel " + heightmap.channel;
  if (heightmap.floor != usual.floor) words += " --floor " + heightmap.floor;
  if (heightmap.invert) words += " --invert";
  if (heightmap.normalise) words += " --normalise";
  if (heightmap.width != usual.width || heightmap.height != usual.height)
    words += fmt::format(" --size {}x{}", heightmap.width, heightmap.height);
  if (heightmap.seed != usual.seed) words += fmt::format(" --seed {}", heightmap.seed);
  if (scene.wrap != Scene{}.wrap) words += " --wrap clamp";
  if (scene.relief_depth != Scene{}.relief_depth) words += fmt::format(" --relief-depth {}", scene.relief_depth);
  if (scene.base != Scene{}.base) words += fmt::format(" --base {}", scene.base);
  return words;
}

ChosenSetting choose_setting(const SettingArguments& arguments, std::string_view command) {
  if (!arguments.tune.empty()) return of_run(of_tune(arguments));
  if (!arguments.run.empty()) return of_run(arguments);
  if (is_setting_key(arguments.case_id)) return {.settings = built_in_setting(arguments.case_id)};
  if (!arguments.case_id.empty()) {
    const Case spec = parse_case(arguments.case_id);
    return {.settings = spec.settings, .scene_id = spec.scene_id};
  }
  if (arguments.presets.empty()) fail_input("{} needs --presets with --quality, --case, or --tune", command);
  return of_presets(arguments);
}

}  // namespace reliefbench
