#include "tuner/cli/compare_rerun.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/cli/format.h"
#include "tuner/cli/rerun.h"
#include "tuner/plan/config_json.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/device_json.h"
#include "tuner/results/host.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

bool is_repeatable(const Run& run) { return !is_of_tune(run) && run.info.contains("config") && !run.scenes.empty(); }

/// Two runs of one build have one source and one set of shaders.
bool are_of_one_build(const Run& base, const Run& now) {
  const json::json_pointer kernels("/identity/kernels_sha256");
  return base.info.value("git_sha", "") == now.info.value("git_sha", "") &&
         base.info.value(kernels, "") == now.info.value(kernels, "");
}

/// Ids of what is in doubt: doubtful cases first, then the cases of doubtful groups.
std::vector<std::string> doubtful_cases(const Comparison& comparison) {
  std::vector<std::string> ids;
  std::set<std::string> seen;
  const auto add = [&](const std::string& id) {
    if (seen.insert(id).second) ids.push_back(id);
  };
  for (const CaseChange& one : comparison.cases)
    if (is_doubtful(one)) add(one.case_id);
  for (const GroupChange& group : comparison.groups)
    if (is_doubtful(group))
      for (const std::string& id : group.case_ids) add(id);
  return ids;
}

/// Files keep their place, wherever the config lies.
json scene_config(const SceneSpec& scene) {
  json config = config_scene_json(scene);
  json& heightmap = config["heightmap"];
  std::error_code ignored;
  if (fs::exists(scene.heightmap.source, ignored)) heightmap["source"] = fs::absolute(scene.heightmap.source).string();
  heightmap["name"] = heightmap_part(scene.id);
  return config;
}

/// A config of just these cases' settings, in their scenes.
json config_of(const Run& run, std::span<const Record* const> records) {
  json scenes = json::array();
  json sweeps = json::array();
  for (const Record* record : records) {
    const MeasuredScene* const scene = find_scene(run.scenes, record->scene_key);
    if (scene == nullptr) fail_input("{}: has no scene '{}'", run.folder.string(), record->scene);
    if (const json one = scene_config(scene->spec); std::ranges::find(scenes, one) == scenes.end())
      scenes.push_back(one);
    if (const json one = config_sweep_json(settings_of(record->technique, record->params));
        std::ranges::find(sweeps, one) == sweeps.end())
      sweeps.push_back(one);
  }
  const json& config = run.info.at("config");
  json made = {{"name", "rerun"}, {"scenes", scenes}, {"sweeps", sweeps}};
  for (const char* key : {"seed", "measure"})
    if (config.contains(key)) made[key] = config.at(key);
  return made;
}

std::string own_binary() {
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  if (error) fail_environment("/proc/self/exe: {}; give --binary-a and --binary-b", error.message());
  return path.string();
}

std::string sweep_command(const std::string& binary, const Run& run, const std::set<std::string>& backends,
                          const fs::path& config) {
  const std::string backend = backends.size() == 1 ? *backends.begin() : std::string("all");
  return fmt::format("{} sweep {} --backend {} --device {} --quiet -o \"$OUT\" >/dev/null", shell_quoted(binary),
                     shell_quoted(config.string()), backend,
                     device_of(run.info.at("identity"), *backends.begin()).value("index", 0));
}

/// The devices that a re-run was measured on must be those of the runs.
void check_device(const Run& base, const fs::path& rerun) {
  const auto expected = named_devices(base);
  for (const auto& [backend, device] : named_devices(load_run(rerun))) {
    const auto own = expected.find(backend);
    if (own != expected.end() && own->second.name != device.name)
      fail_input("the re-run measured on {}, the runs are of {}: re-run on their machine", device.name,
                 own->second.name);
  }
}

std::string case_key(const Record& record) {
  SeriesRow series;
  series.setting = match_key(record);
  series.metric = "frame_time";
  return rerun_key(series);
}

/// Puts the re-runs' answer in the place of the doubtful verdicts.
void judge_again(std::span<const Rerun> reruns, const std::map<std::string, std::string>& keys,
                 const CompareOptions& options, Comparison& comparison) {
  const auto is_measured = [&](const std::string& id) {
    const auto key = keys.find(id);
    return key != keys.end() &&
           std::ranges::all_of(reruns, [&](const Rerun& rerun) { return rerun.log_values.contains(key->second); });
  };
  std::vector<std::pair<TimeChange*, std::set<std::string>>> asked;
  for (CaseChange& one : comparison.cases)
    if (is_doubtful(one) && is_measured(one.case_id)) asked.push_back({&one, {keys.at(one.case_id)}});
  for (GroupChange& group : comparison.groups) {
    if (!is_doubtful(group) || !std::ranges::all_of(group.case_ids, is_measured)) continue;
    asked.push_back({&group, {}});
    for (const std::string& id : group.case_ids) asked.back().second.insert(keys.at(id));
  }
  if (asked.empty()) fail_input("no doubtful case was measured in all re-runs: are the scenes still the same?");
  const double confidence = 1 - (1 - options.confidence) / static_cast<double>(asked.size());
  for (const auto& [change, series] : asked) {
    const RerunStep step = rerun_step(reruns, series, confidence);
    set_remeasured(*change, step.log_ratio, step.low, step.high, options.threshold);
  }
}

}  // namespace

json rerun_doubtful(const Run& base, const Run& now, const CompareOptions& options, const RerunArguments& arguments,
                    Comparison& comparison) {
  if (options.metric != "frame_time") fail_input("--rerun measures frame_time, not {}", options.metric);
  for (const Run* run : {&base, &now})
    if (!is_repeatable(*run))
      fail_input("{}: is no sweep's folder, so nothing can be measured again", run->folder.string());
  const bool is_one_build = are_of_one_build(base, now);
  if (!is_one_build && (arguments.binary_a.empty() || arguments.binary_b.empty()))
    fail_input("the runs are of two builds ({} and {}): --rerun needs --binary-a and --binary-b",
               base.info.value("git_sha", "unknown"), now.info.value("git_sha", "unknown"));
  std::vector<std::string> ids = doubtful_cases(comparison);
  json rerun = {{"cases", 0}, {"left_out", 0}, {"rounds", arguments.rounds}, {"folder", ""}};
  if (ids.empty()) return rerun;
  rerun["left_out"] = ids.size() - std::min(ids.size(), arguments.most_cases);
  ids.resize(std::min(ids.size(), arguments.most_cases));
  rerun["cases"] = ids.size();

  std::vector<const Record*> records;
  std::map<std::string, std::string> keys;  // by case id
  std::set<std::string> backends;
  for (const Record& record : base.records)
    if (std::ranges::find(ids, record.case_id) != ids.end()) {
      records.push_back(&record);
      keys.emplace(record.case_id, case_key(record));
      backends.insert(record.backend);
    }
  const std::string binary_a = arguments.binary_a.empty() ? own_binary() : arguments.binary_a;
  const std::string binary_b = arguments.binary_b.empty() ? own_binary() : arguments.binary_b;
  rerun["same_build"] = binary_a == binary_b;
  const std::string config = json_text(config_of(base, records), 1) + "\n";
  const fs::path output = fs::absolute(
      arguments.output.empty() ? fs::path("out/rerun") / sha256(binary_a + '\n' + binary_b + '\n' + config).substr(0, 8)
                               : arguments.output);
  rerun["folder"] = output.string();
  fs::create_directories(output);
  const fs::path config_file = output / "rerun.json";
  write_output(config_file, config);
  std::set<std::string> wanted;
  for (const auto& [id, key] : keys) wanted.insert(key);
  const std::vector<Rerun> reruns =
      rerun_in_turns({.first = {.name = "a",
                                .label = "the build of " + base.folder.string(),
                                .command = sweep_command(binary_a, base, backends, config_file)},
                      .second = {.name = "b",
                                 .label = "the build of " + now.folder.string(),
                                 .command = sweep_command(binary_b, now, backends, config_file)},
                      .rounds = arguments.rounds,
                      .output = output,
                      .quiet = arguments.quiet,
                      .check = [&](const fs::path& out) { check_device(base, out); }},
                     wanted);
  judge_again(reruns, keys, options, comparison);
  return rerun;
}

void print_rerun(const json& rerun) {
  const int cases = rerun.at("cases");
  if (cases == 0) {
    put("re-run: nothing is in doubt\n");
    return;
  }
  put("re-run: {} cases, {} rounds in turns, in {}\n", cases, rerun.at("rounds").get<int>(),
      rerun.at("folder").get<std::string>());
  if (const int left_out = rerun.at("left_out"); left_out > 0)
    put("  {} more cases are in doubt and were left out (--rerun-cases); groups that hold them keep their verdict\n",
        left_out);
  if (rerun.at("same_build").get<bool>())
    put("  both sides were one build on one device: it says whether these cases differ from themselves. A difference "
        "that\n  is gone now was the state of the machine in the first runs; what two builds differ in needs "
        "--binary-a and --binary-b\n");
}

std::string settling_command(const Run& base, const Run& now, const Comparison& comparison) {
  if (comparison.metric != "frame_time" || !comparison.drivers.empty() || !is_repeatable(base) || !is_repeatable(now))
    return "";
  if (doubtful_cases(comparison).empty()) return "";
  return fmt::format("reliefbench compare {} {} --rerun{}", shell_quoted(base.folder.string()),
                     shell_quoted(now.folder.string()),
                     are_of_one_build(base, now) ? "" : " --binary-a BASE_BUILD --binary-b NEW_BUILD");
}

}  // namespace reliefbench
