#include "tuner/tune/tune.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "backends/worker/remote.h"
#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/image/heightmaps.h"
#include "reports/pages/tune_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/features_option.h"
#include "tuner/cli/format.h"
#include "tuner/cli/interrupt.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/cli/tune_text.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/scene_file.h"
#include "tuner/plan/scene_json.h"

namespace reliefbench {
namespace {

struct TuneArguments {
  std::string subject;
  std::string output;
  std::vector<std::string> scenes;
  std::vector<Budget> max_error;
  std::optional<double> max_time_ms{};
  std::vector<std::string> holdout;
  std::vector<double> weights;
  std::string features;
  std::string combine = "weighted";
  std::string backend;
  int device = 0;
  double epsilon = 0.02;
  double confidence = 0.95;
  std::string time_limit;
  std::uint64_t seed = 1;
  std::string replay;
  std::vector<std::string> fleet;
  std::string regret{regret_id(Regret::minimax)};
  ReadingArguments reading;
  bool retry_failed = false;
  std::optional<double> relief_depth;
  std::optional<double> base;
  std::optional<Size> frame_px;
  std::optional<std::string> wrap;
  std::optional<double> tiling;
  Names names;
  bool quiet = false;
  bool json = false;
};

/// "90s", "10m", "1.5h", or seconds.
double parse_duration_s(const std::string& text) {
  const std::size_t end = std::min(text.find_last_not_of("smh") + 1, text.size());
  const std::string unit = text.substr(end);
  const double scale = unit.empty() || unit == "s" ? 1 : unit == "m" ? 60 : unit == "h" ? 3600 : 0;
  const std::optional<double> value = finite_number(std::string_view(text).substr(0, end));
  if (!value || *value <= 0 || scale == 0)
    fail_input("--time-limit '{}': expected a duration such as 90s, 10m or 1.5h", text);
  return *value * scale;
}

bool is_config(const std::string& subject) { return subject.ends_with(".json"); }

/// Whether the subject is a scene file: its `visible` is the budget unless --max-error gives one.
bool is_scene(const std::string& subject) { return is_config(subject) && is_scene_file(read_file(subject), subject); }

/// With all its scenes.
Config subject_config(const TuneArguments& arguments) {
  SceneOptions options{.relief_depth = arguments.relief_depth,
                       .base = arguments.base,
                       .frame_px = arguments.frame_px,
                       .wrap = arguments.wrap,
                       .tiling = arguments.tiling};
  if (!is_config(arguments.subject)) {
    options.views = arguments.scenes;
    HeightmapSpec heightmap{.source = arguments.subject};
    set_reading(heightmap, arguments.reading);
    return default_tune_config(heightmap, options);
  }
  const ReadingArguments& reading = arguments.reading;
  if (reading.channel || reading.floor || reading.invert || reading.normalise)
    fail_input("{}: a config says itself how its heightmaps are read; the command's options are for a heightmap",
               arguments.subject);
  return is_scene(arguments.subject) ? scene_tune_config(arguments.subject, options)
                                     : with_scene_options(load_config(arguments.subject), options);
}

/// The scenes of a config that are asked for.
std::vector<SceneSpec> chosen_scenes(const Config& config, const TuneArguments& arguments) {
  std::set<std::string> known;
  for (const SceneSpec& scene : config.scenes) known.insert(scene.id);
  std::vector<SceneSpec> kept;
  for (const std::string& id : arguments.scenes) {
    const auto found = std::ranges::find_if(config.scenes, [&](const SceneSpec& scene) {
      return scene.id == id || scene.id.substr(scene.id.find('/') + 1) == id;
    });
    if (found == config.scenes.end()) fail_scene(id, known, arguments.subject);
    kept.push_back(*found);
  }
  return kept;
}

Config config_of(const TuneArguments& arguments) {
  Config config = subject_config(arguments);
  if (!arguments.features.empty()) config = with_features(config, arguments.features);  // all its scenes again
  if (is_config(arguments.subject) && !arguments.scenes.empty()) config.scenes = chosen_scenes(config, arguments);
  return config;
}

std::vector<SceneSpec> holdout_of(const TuneArguments& arguments, const Config& config) {
  std::vector<SceneSpec> scenes;
  for (const std::string& heightmap : arguments.holdout) {
    HeightmapSpec read_alike{.source = heightmap};
    set_reading(read_alike, arguments.reading);
    std::vector<SceneSpec> same_views = default_tune_config(read_alike, {}).scenes;
    for (const SceneSpec& scene : config.scenes) {
      SceneSpec held_out = same_views.front();
      held_out.scene = scene.scene;
      held_out.has_default_frame = scene.has_default_frame;
      held_out.id = held_out.id.substr(0, held_out.id.find('/')) + scene.id.substr(scene.id.find('/'));
      scenes.push_back(std::move(held_out));
    }
  }
  return scenes;
}

TuneOptions options_of(const TuneArguments& arguments) {
  TuneOptions options;
  options.output = arguments.output;
  options.backend = arguments.backend;
  options.device = arguments.device;
  options.quiet = arguments.quiet;
  options.retry_failed = arguments.retry_failed;
  TuneQuestion& question = options.question;
  question.max_error = arguments.max_error;
  question.max_time_ms = arguments.max_time_ms;
  question.epsilon = arguments.epsilon;
  question.confidence = arguments.confidence;
  question.seed = arguments.seed;
  if (!arguments.time_limit.empty()) options.time_limit_s = parse_duration_s(arguments.time_limit);
  options.weights = arguments.weights;
  options.combine = arguments.combine == "worst" ? Combine::worst : Combine::weighted;
  options.is_interrupted = is_interrupted;
  if (arguments.fleet.empty()) return options;
  if (question.max_time_ms)
    fail_input("--fleet chooses the fastest within bounds on error; --max-time-ms is no such bound");
  options.fleet.emplace(TuneFleet{.regret = find_regret(arguments.regret)});
  for (const std::string& run : arguments.fleet) options.fleet->runs.push_back(load_fleet_run(run));
  if (question.max_error.empty()) question.max_error = common_budgets(options.fleet->runs);
  return options;
}

Exit exit_of(const TuneResult& result) {
  const bool is_no = !result.pick || !result.fleet_refusal.empty();
  if (is_no) return result.is_stopped ? Exit::inconclusive : Exit::answer_is_no;
  return result.is_certified() ? Exit::done : Exit::inconclusive;
}

/// out/tune_HEIGHTMAP_VIEW_KEY: the key stands for the whole question, so that another question has another folder.
std::filesystem::path default_folder(const TuneArguments& arguments, const Config& config, const TuneOptions& options) {
  std::vector<std::string> question = {config_sha256(config),
                                       arguments.combine,
                                       fmt::format("{}", fmt::join(arguments.weights, ",")),
                                       options.backend,
                                       fmt::format("{}", options.device),
                                       fmt::format("{}", fmt::join(budget_texts(arguments.max_error), ",")),
                                       arguments.max_time_ms ? fmt::format("{}", *arguments.max_time_ms) : "",
                                       fmt::format("{}", arguments.epsilon),
                                       fmt::format("{}", arguments.confidence),
                                       fmt::format("{}", arguments.seed),
                                       options.fleet ? fleet_sha256(*options.fleet) : ""};
  Heightmaps heightmaps;  // no config says what their files hold
  for (const SceneSpec& spec : config.scenes) {
    question.push_back(spec.id);
    question.push_back(measured_scene(spec, heightmaps.read(spec.heightmap)).key.hex);
  }
  const std::string key = sha256(fmt::format("{}", fmt::join(question, "\n"))).substr(0, 8);
  std::string scene = config.scenes.front().id;
  std::ranges::replace(scene, '/', '_');
  return std::filesystem::path("out") / fmt::format("tune_{}_{}", scene, key);
}

/// Refuses options that say how frames are drawn: a recorded run's are as they are.
void refuse_with_replay(const CLI::App& command) {
  for (const char* name :
       {"SUBJECT", "--device", "--channel", "--floor", "--invert", "--normalise", "--relief-depth", "--base",
        "--frame-px", "--wrap", "--tiling", "--holdout", "--combine", "--weights", "--retry-failed"})
    if (!command.get_option(name)->empty())
      fail_input("{}: has no meaning with --replay, where nothing is drawn and one scene is searched", name);
}

std::string chosen_backend(const std::string& name) {
  if (!name.empty()) return choose_backends(name).front();
  const std::vector<std::string> all = choose_backends("all");
  return std::ranges::find(all, "vulkan") != all.end() ? "vulkan" : all.front();
}

Exit tune_command(const TuneArguments& arguments) {
  TuneOptions options = options_of(arguments);
  heed_interrupts();
  TuneResult result;
  if (!arguments.replay.empty()) {
    if (arguments.scenes.size() > 1) fail_input("--replay takes one --scene");
    if (!arguments.features.empty()) fail_input("--features: a recorded run's space is what was recorded");
    result = replay_tune(arguments.replay, arguments.scenes.empty() ? "" : arguments.scenes.front(), options);
  } else {
    if (arguments.subject.empty()) fail_input("tune needs a heightmap or a config (or --replay RUN)");
    options.backend = chosen_backend(arguments.backend);
    options.open = open_isolated;
    const Config config = config_of(arguments);
    if (is_scene(arguments.subject) && options.question.max_error.empty()) options.question.max_error = config.budgets;
    if (options.output.empty()) options.output = default_folder(arguments, config, options);
    if (options.fleet && config.scenes.size() > 1)
      fail_input("--fleet is for one scene, {} has {}: choose it by --scene", arguments.subject, config.scenes.size());
    if (!options.weights.empty() && options.weights.size() != config.scenes.size())
      fail_input("--weights: {} given for {} scenes", options.weights.size(), config.scenes.size());
    options.holdout = holdout_of(arguments, config);
    result = run_tune(config, options);
  }
  if (!options.output.empty()) write_tune_page(result, options.output);
  if (arguments.json) {
    print_json(tune_json(result), 1);
  } else {
    print_tune_result(result, arguments.names);
    if (!options.output.empty()) put("\nreport: {}\n", (options.output / kTunePage).string());
    if (arguments.replay.empty()) print_next_commands(result, options.output.string());
  }
  return exit_of(result);
}

/// What is asked, and how the answer is looked for.
void add_question_options(CLI::App& command, TuneArguments& arguments) {
  command.add_option(
      "SUBJECT", arguments.subject,
      "a heightmap (name or file) or a scene file on the built-in space, or a config whose sweeps are the space");
  command.add_option(
      "-o,--output", arguments.output,
      "folder, where an interrupted search is continued; default: one of its own for each question, under out/");
  take_each(command.add_option("--scene", arguments.scenes,
                               "view of the heightmap, or scene of the config; may be repeated"));
  add_bounds_option(command, "--max-error", arguments.max_error,
                    "bound on a metric, e.g. 'e_xy.p99<=0.5'; may be repeated. Without: the whole front");
  command.add_option("--max-time-ms", arguments.max_time_ms, "then the most accurate within it")
      ->type_name("MS")
      ->check(above_zero());
  command.add_option("--epsilon", arguments.epsilon, "how much slower than the best the pick may be")
      ->check(above_zero())
      ->capture_default_str();
  command.add_option("--confidence", arguments.confidence, "of the certificate")
      ->check(expect_number("a number between 0.5 and 1", [](double share) { return share > 0.5 && share < 1; }))
      ->capture_default_str();
  command
      .add_option(
          "--time-limit", arguments.time_limit,
          fmt::format(
              "90s, 10m, 1h: then the answer so far; default: none, it goes on until the answer is certain, with "
              "--replay for {} samples a setting at most",
              kReplayPatience))
      ->type_name("T");
  take_each(command.add_option("--holdout", arguments.holdout,
                               "heightmap on which the pick is only tried, read as SUBJECT is; may be repeated"));
  command.add_option("--combine", arguments.combine, "several scenes: weighted sum of their times, or the worst")
      ->check(CLI::IsMember({"weighted", "worst"}))
      ->capture_default_str();
  add_weights_option(command, arguments.weights, "of the scenes, e.g. 2,1,1");
  command.add_option("--backend", arguments.backend, "opengl | vulkan | null; default: vulkan where it has a device");
  add_device_option(command, arguments.device);
  command.add_option("--seed", arguments.seed, "of the audits, and of replay's noise")->capture_default_str();
}

/// Runs of other devices, or one in the place of a device.
void add_fleet_options(CLI::App& command, TuneArguments& arguments) {
  command.add_option("--replay", arguments.replay, "a recorded sweep (run folder or table.csv) instead of a device")
      ->type_name("RUN");
  command
      .add_option("--fleet", arguments.fleet,
                  "runs of other devices in the same scene (run folders or table.csv): the setting for all of them and "
                  "this device, too")
      ->type_name("RUN ...");
  command
      .add_option("--regret", arguments.regret,
                  "of the fleet; minimax: the least worst loss | mean: the least mean of the losses")
      ->check(CLI::IsMember(regret_ids()))
      ->type_name("RULE")
      ->capture_default_str();
}

void add_scene_options(CLI::App& command, TuneArguments& arguments) {
  command.add_option("--relief-depth", arguments.relief_depth, "in sides of one tile; default: 0.1, or the config's")
      ->check(not_below_zero());
  add_base_option(command, arguments.base, "1, or the config's");
  add_frame_option(command, arguments.frame_px);
  command.add_option("--wrap", arguments.wrap, "repeat | clamp")->check(CLI::IsMember({"repeat", "clamp"}));
  command.add_option("--tiling", arguments.tiling, "tiles along a side of the surface")->check(above_zero());
}

}  // namespace

void add_tune_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("tune", "search for the settings to ship, and say how sure the answer is");
  const auto arguments = std::make_shared<TuneArguments>();
  add_question_options(*command, *arguments);
  add_fleet_options(*command, *arguments);
  add_channel_options(*command, arguments->reading);
  command->add_flag("--retry-failed", arguments->retry_failed,
                    "draw again what failed in an earlier start, also what failed twice");
  add_features_option(*command, arguments->features);
  add_scene_options(*command, *arguments);
  add_names_option(*command, arguments->names);
  add_quiet_option(*command, arguments->quiet);
  command->add_flag("--json", arguments->json, "tune.json on standard output");
  command->footer(
      "Exit code 1 where nothing meets the bounds, with --fleet on all devices; 4 where the precision was not "
      "reached.\n"
      "Ctrl-C, SIGTERM and SIGHUP (a closed terminal) end the search with the answer so far.\n"
      "With --fleet the search ends with what `choose` says of these runs and this one. It times where that is "
      "decided:\n"
      "this device's best setting, and those that lose little on the others.\n"
      "Examples:\n"
      "  reliefbench tune rocks --max-error 'e_xy.p99<=0.5' --max-error 'missed_rate<=0.001' --time-limit 3m -o "
      "out/tune\n"
      "  reliefbench tune rocks --scene grazing --fleet out/h200 out/phone -o out/tune\n"
      "  reliefbench tune configs/scenes/floor.json --features shadow,penumbra -o out/floor_tuned");
  command->callback([=, &exit_code] {
    if (!arguments->replay.empty()) refuse_with_replay(*command);
    exit_code = tune_command(*arguments);
  });
}

}  // namespace reliefbench
