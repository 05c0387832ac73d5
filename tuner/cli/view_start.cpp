#include "tuner/cli/view_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/scene_choice.h"
#include "tuner/decide/pareto.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_names.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_question.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

constexpr const char* kPlainTechnique = "relaxed_cone";
constexpr const char* kSolidTechnique = "double_cone";

/// One of the run's fronts: that of the scene and backend that are asked for, else the first.
Front chosen_front(const Run& run, const RunQuestion& question, const SettingArguments& arguments,
                   const std::string& case_scene) {
  std::vector<Front> all = fronts(run.records, question.error_metric, question.constraints);
  std::erase_if(all, [](const Front& front) { return front.points.empty(); });
  if (all.empty())
    throw Error(
        Exit::nothing_measured,
        fmt::format("{}: has no front, nothing in it was measured within its constraints", run.folder.string()));
  const std::string scene = case_scene.empty() ? arguments.scene : case_scene;
  std::vector<std::string> known;
  known.reserve(all.size());
  for (const Front& front : all) known.push_back(fmt::format("{} on {}", front.scene, front.backend));
  std::erase_if(all, [&](const Front& front) {
    return (!scene.empty() && front.scene != scene) ||
           (!arguments.choice.backend.empty() && front.backend != arguments.choice.backend);
  });
  if (all.empty())
    fail_input("{}: has no front of scene '{}' and backend '{}'; it has {}", run.folder.string(),
               scene.empty() ? "*" : scene, arguments.choice.backend.empty() ? "*" : arguments.choice.backend,
               fmt::join(known, ", "));
  if (all.size() > 1)
    write_stderr(fmt::format("view: {} on {}, the first of {} fronts; --scene and --backend choose another\n",
                             one_line(all.front().scene), one_line(all.front().backend), all.size()));
  return std::move(all.front());
}

ViewPicks picks_of(const Front& front) {
  ViewPicks picks{.error_metric = front.error_metric};
  for (const FrontPoint& point : front.points) {
    const Settings settings = settings_of(point.record->technique, point.record->params);
    picks.points.push_back(
        {.settings = settings, .label = short_name(settings), .time_ns = point.time_ns, .error = point.error});
  }
  return picks;
}

/// Place of the fastest point within the run's budgets; of the most accurate where none is.
std::size_t first_choice(const Front& front, std::span<const Budget> budgets) {
  const auto is_within = [&](const FrontPoint& point) {
    return std::ranges::all_of(budgets, [&](const Budget& budget) { return meets(*point.record, budget); });
  };
  const auto found = std::ranges::find_if(front.points, is_within);
  return found == front.points.end() ? front.points.size() - 1 : static_cast<std::size_t>(found - front.points.begin());
}

/// Of --run or --tune.
ViewStart start_of_run(const SettingArguments& arguments) {
  const Run run = load_run(arguments.tune.empty() ? arguments.run : arguments.tune);
  const RunQuestion question = question_of(run);
  std::optional<ChosenSetting> asked;
  if (!arguments.case_id.empty() || !arguments.tune.empty()) asked = choose_setting(arguments, "view");
  const Front front = chosen_front(run, question, arguments, asked ? asked->scene_id : "");
  ViewPicks picks = picks_of(front);
  if (asked) return {.chosen = std::move(*asked), .picks = std::move(picks)};
  const MeasuredScene* const scene = find_scene(run.scenes, front.scene_key);
  if (scene == nullptr) fail_input("{}: does not say what scene '{}' is", run.folder.string(), front.scene);
  const Settings settings = picks.points.at(first_choice(front, question.budgets)).settings;
  return {.chosen = {.settings = settings, .backend = front.backend, .scene_id = front.scene, .scenes = {*scene}},
          .picks = std::move(picks)};
}

}  // namespace

ViewStart view_start(SettingArguments& arguments, bool is_still) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(std::filesystem::path(arguments.heightmap) / kRunFile, ignored)) {
    for (const auto& [option, folder] : {std::pair("--run", &arguments.run), std::pair("--tune", &arguments.tune)})
      if (!folder->empty() && *folder != arguments.heightmap)
        fail_input("there are two runs: {} and {} {}", arguments.heightmap, option, *folder);
    if (!arguments.presets.empty())
      fail_input("{} is a run's folder, and --presets has settings, too", arguments.heightmap);
    arguments.run = std::exchange(arguments.heightmap, "");
    return start_of_run(arguments);
  }
  if (std::filesystem::is_directory(arguments.heightmap, ignored))
    fail_input("{}: is a folder, but no run's or tune's: it has no {}", arguments.heightmap, kRunFile);
  if (!arguments.run.empty() || !arguments.tune.empty()) return start_of_run(arguments);
  const bool says_nothing = arguments.presets.empty() && arguments.case_id.empty();
  if (says_nothing && arguments.heightmap.empty())
    fail_input("view needs a HEIGHTMAP, the folder of a run, --presets with --quality, --tune, or --case");
  if (says_nothing && !is_still) {
    const bool sees_solid = is_solid(told_heightmap(arguments));
    return {.chosen = {.settings = Settings(find_technique(sees_solid ? kSolidTechnique : kPlainTechnique))}};
  }
  ViewStart start{.chosen = choose_setting(arguments, "view")};
  for (const LoadedPreset& level : start.chosen.levels)
    start.picks.levels.push_back({.settings = level.settings,
                                  .label = fmt::format("quality {}: {}", level.quality, short_name(level.settings)),
                                  .quality = level.quality});
  return start;
}

}  // namespace reliefbench
