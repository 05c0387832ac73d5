#include "tuner/tune/tune.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "reports/pages/tune_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/measure/sweep.h"

namespace reliefbench {
namespace {

struct Arguments {
  std::string subject;
  std::string output;
  std::vector<std::string> scenes;
  std::vector<std::string> max_error;
  std::string max_time_ms;
  std::vector<std::string> holdout;
  std::string weights;
  std::string combine = "weighted";
  std::string backend;
  int device = 0;
  double epsilon = 0.02;
  double confidence = 0.95;
  std::string time_limit;
  std::uint64_t seed = 1;
  std::string replay;
  ReadingArguments reading;
  bool retry_failed = false;
  bool quiet = false;
  bool json = false;
};

std::atomic<bool>& interrupted() {
  static std::atomic<bool> flag = false;
  return flag;
}
extern "C" void on_interrupt(int) { interrupted() = true; }

/// "90s", "10m", "1.5h", or seconds.
double parse_duration_s(const std::string& text) {
  std::size_t used = 0;
  double value = -1;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  const std::string unit = text.substr(std::min(used, text.size()));
  const double scale = unit.empty() || unit == "s" ? 1 : unit == "m" ? 60 : unit == "h" ? 3600 : 0;
  if (used == 0 || !(value > 0) || scale == 0)
    fail_input("--time-limit '{}': expected a duration such as 90s, 10m or 1.5h", text);
  return value * scale;
}

double parse_positive(const std::string& option, const std::string& text) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used != text.size() || !(value > 0)) fail_input("{} '{}': expected a number above 0", option, text);
  return value;
}

std::vector<double> parse_weights(const std::string& text) {
  std::vector<double> weights;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    weights.push_back(parse_positive("--weights", text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return weights;
}

bool is_config(const std::string& subject) { return subject.ends_with(".json"); }

Config config_of(const Arguments& arguments) {
  HeightmapSpec heightmap{.source = arguments.subject};
  set_reading(heightmap, arguments.reading);
  if (!is_config(arguments.subject)) return default_tune_config(heightmap, arguments.scenes);
  if (arguments.reading.channel || arguments.reading.invert || arguments.reading.normalise)
    fail_input("{}: a config says itself how its heightmaps are read; the command's options are for a heightmap",
               arguments.subject);
  Config config = load_config(arguments.subject);
  if (arguments.scenes.empty()) return config;
  std::vector<SceneSpec> kept;
  for (const std::string& id : arguments.scenes) {
    const auto found = std::ranges::find_if(config.scenes, [&](const SceneSpec& scene) {
      return scene.id == id || scene.id.substr(scene.id.find('/') + 1) == id;
    });
    if (found == config.scenes.end()) fail_input("--scene '{}': {} has no such scene", id, arguments.subject);
    kept.push_back(*found);
  }
  config.scenes = std::move(kept);
  return config;
}

std::vector<SceneSpec> holdout_of(const Arguments& arguments, const Config& config) {
  std::vector<SceneSpec> scenes;
  for (const std::string& heightmap : arguments.holdout) {
    std::vector<SceneSpec> same_views = default_tune_config({.source = heightmap}, {}).scenes;
    for (const SceneSpec& scene : config.scenes) {
      SceneSpec held_out = same_views.front();
      held_out.scene = scene.scene;
      held_out.id = held_out.id.substr(0, held_out.id.find('/')) + scene.id.substr(scene.id.find('/'));
      scenes.push_back(std::move(held_out));
    }
  }
  return scenes;
}

TuneOptions options_of(const Arguments& arguments) {
  TuneOptions options;
  options.output = arguments.output;
  options.backend = arguments.backend;
  options.device = arguments.device;
  options.quiet = arguments.quiet;
  options.retry_failed = arguments.retry_failed;
  TuneQuestion& question = options.question;
  for (const std::string& text : arguments.max_error) question.max_error.push_back(parse_budget(text));
  if (!arguments.max_time_ms.empty()) question.max_time_ms = parse_positive("--max-time-ms", arguments.max_time_ms);
  question.epsilon = arguments.epsilon;
  question.confidence = arguments.confidence;
  question.seed = arguments.seed;
  if (!(question.epsilon > 0)) fail_input("--epsilon {}: expected a number above 0", question.epsilon);
  if (!(question.confidence > 0.5 && question.confidence < 1))
    fail_input("--confidence {}: expected a number between 0.5 and 1", question.confidence);
  if (!arguments.time_limit.empty()) options.time_limit_s = parse_duration_s(arguments.time_limit);
  options.weights = parse_weights(arguments.weights);
  options.combine = arguments.combine == "worst" ? Combine::worst : Combine::weighted;
  options.is_interrupted = [] { return interrupted().load(); };
  return options;
}

std::string percent(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:.2f} %", 100 * ratio) : std::string("an unknown share");
}

std::string interval(double time_ns, double high_ns) {
  return fmt::format("{} (at most {})", format_time_ns(time_ns), format_time_ns(high_ns));
}

void print_space(const TuneResult& result) {
  const TuneCounts& counts = result.counts;
  fmt::print("{} settings", counts.settings);
  if (!result.replayed.empty()) fmt::print(" of {}", result.replayed);
  fmt::print(", {}, {}\n", result.backend, result.device);
  if (counts.is_bisected)
    fmt::print(
        "  errors by bisection: {} scored; {} taken to be no faster than a scored one with fewer steps; {} miss "
        "the budgets as more steps do\n",
        counts.scored, counts.assumed, counts.hopeless);
  if (counts.failed > 0) fmt::print("  {} could not be drawn\n", counts.failed);
}

void print_certificate(const TuneResult& result, const Paint& paint) {
  const SearchResult& search = result.search;
  const auto assumed = std::ranges::count(search.states, Evidence::assumed, &CandidateState::evidence);
  fmt::print("  {} of {} settings timed, {} ruled out by fewer steps of the same chain (slack {})\n", search.measured,
             result.space.candidates.size(), assumed, percent(search.slack));
  if (search.samples > 0)
    fmt::print("  {} samples, those of a round correlated by at most {:.2f}\n", search.samples, search.correlation);
  fmt::print("  {} audits of what was ruled out, {} wrong\n", search.audits, search.audit_failures);
  fmt::print("  {}\n", result.is_certified() ? paint.good(result.claim()) : paint.bad(result.claim()));
}

void print_answers(const TuneResult& result, const Paint& paint) {
  if (result.search.answers.size() < 2) return;
  const std::string within = result.counts.unscored > 0 ? "within, of those scored" : "within";
  std::vector<std::vector<std::string>> rows{
      {paint.bold(result.error_metric + " at most"), paint.bold("time"), paint.bold(within), paint.bold("setting")}};
  for (const BudgetAnswer& answer : result.search.answers)
    rows.push_back({format_number(result.space.candidates[answer.pick].error), format_time_ns(answer.time_ns),
                    percent(answer.gap), result.space.candidates[answer.pick].id});
  fmt::print("\n{}\n", columns(rows));
}

void print_rungs(const TuneResult& result) {
  if (result.rungs.empty()) return;
  fmt::print("\nFrom the fewest features that do to the fastest:\n");
  double before_ns = 0;
  for (const TuneRung& rung : result.rungs) {
    fmt::print("  {}  {}\n", format_time_ns(rung.time_ns), rung.setting);
    if (before_ns > 0)
      fmt::print("      {:.1f} % faster for {}{}{}\n", 100 * (1 - rung.time_ns / before_ns),
                 fmt::join(rung.gained, ", "), rung.dropped.empty() ? "" : ", without ", fmt::join(rung.dropped, ", "));
    before_ns = rung.time_ns;
  }
}

void print_scenes(const TuneResult& result, const Paint& paint) {
  if (!result.scene_answers.empty()) fmt::print("\nEach scene by itself:\n");
  for (const SceneAnswer& answer : result.scene_answers) {
    if (!answer.own) {
      fmt::print("  {}: no answer\n", answer.scene);
      continue;
    }
    const double gain = answer.common_ns > 0 ? 1 - answer.own->time_ns / answer.common_ns : 0;
    fmt::print("  {}: {}, {:.1f} % less than the common pick's {} there\n      {}\n", answer.scene,
               format_time_ns(answer.own->time_ns), 100 * gain, format_time_ns(answer.common_ns), answer.own->setting);
  }
  if (!result.holdout.empty()) fmt::print("\nThe pick on what it was not tuned on:\n");
  for (const HoldoutAnswer& answer : result.holdout) {
    const std::string verdict = !answer.failure.empty() ? paint.bad(answer.failure)
                                : answer.miss.empty()   ? paint.good("meets the budgets")
                                                        : paint.bad(answer.miss);
    fmt::print("  {}: {}{}\n", answer.scene, verdict,
               answer.failure.empty() ? ", " + format_time_ns(answer.time_ns) : "");
  }
}

void print_result(const TuneResult& result) {
  const Paint paint = paint_for_stdout();
  print_space(result);
  if (result.pick) {
    fmt::print("\n{} {}\n", paint.bold("pick"), paint.good(result.pick->setting));
    fmt::print("  {}   {} {}   within {} of the best{}\n", interval(result.pick->time_ns, result.pick->high_ns),
               result.error_metric, format_number(result.pick->error), percent(result.pick->gap),
               result.counts.unscored > 0 ? " of those scored" : "");
    if (!result.pick->tie.empty())
      fmt::print("  tie with {}: the pick is the simpler or smaller of settings that time does not tell apart\n",
                 result.pick->tie);
  } else if (!result.search.is_feasible && !result.is_stopped) {
    fmt::print("\n{}{}{}\n", paint.bad("nothing meets the budgets"), result.miss.empty() ? "" : ": ", result.miss);
    if (!result.nearest.empty()) fmt::print("  nearest: {}\n", result.nearest);
  } else {
    fmt::print("\n{}\n", paint.bad(result.is_stopped ? "no pick yet: stopped too early" : "no pick"));
  }
  print_certificate(result, paint);
  print_rungs(result);
  print_answers(result, paint);
  print_scenes(result, paint);
}

Exit exit_of(const TuneResult& result) {
  if (!result.pick && result.search.measured == 0 && !result.is_stopped) return Exit::answer_is_no;
  if (!result.pick) return result.is_stopped ? Exit::inconclusive : Exit::answer_is_no;
  return result.is_certified() ? Exit::done : Exit::inconclusive;
}

std::string chosen_backend(const std::string& name) {
  if (!name.empty()) return choose_backends(name).front();
  const std::vector<std::string> all = choose_backends("all");
  return std::ranges::find(all, "vulkan") != all.end() ? "vulkan" : all.front();
}

void run(const Arguments& arguments, int& exit_code) {
  TuneOptions options = options_of(arguments);
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, on_interrupt);
  TuneResult result;
  if (!arguments.replay.empty()) {
    if (arguments.scenes.size() > 1) fail_input("--replay takes one --scene");
    result = replay_tune(arguments.replay, arguments.scenes.empty() ? "" : arguments.scenes.front(), options);
  } else {
    if (arguments.subject.empty()) fail_input("tune needs a heightmap or a config (or --replay RUN)");
    if (arguments.output.empty()) fail_input("tune needs an output folder: -o DIR");
    const Config config = config_of(arguments);
    if (!options.weights.empty() && options.weights.size() != config.scenes.size())
      fail_input("--weights: {} given for {} scenes", options.weights.size(), config.scenes.size());
    options.backend = chosen_backend(arguments.backend);
    options.holdout = holdout_of(arguments, config);
    result = run_tune(config, options);
  }
  if (!arguments.output.empty()) write_tune_page(result, arguments.output);
  if (arguments.json) {
    fmt::print("{}\n", tune_json(result).dump(1));
  } else {
    print_result(result);
    if (!arguments.output.empty()) fmt::print("\nreport: {}/{}\n", arguments.output, kTunePage);
  }
  exit_code = static_cast<int>(exit_of(result));
}

}  // namespace

void add_tune_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("tune", "search for the settings to ship, and say how sure the answer is");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("SUBJECT", arguments->subject,
                      "a heightmap (name or file) on the built-in space, or a config whose sweeps are the space");
  command->add_option("-o,--output", arguments->output, "folder; an interrupted search there is continued");
  command->add_option("--scene", arguments->scenes, "view of the heightmap, or scene of the config; may be repeated")
      ->expected(1)
      ->take_all();
  command
      ->add_option("--max-error", arguments->max_error,
                   "bound on a metric, e.g. 'e_xy.p99<=0.5'; may be repeated. Without: the whole front")
      ->type_name("BOUND")
      ->expected(1)
      ->take_all();
  command->add_option("--max-time-ms", arguments->max_time_ms, "then the most accurate within it")->type_name("MS");
  command->add_option("--epsilon", arguments->epsilon, "how much slower than the best the pick may be")
      ->capture_default_str();
  command->add_option("--confidence", arguments->confidence, "of the certificate")->capture_default_str();
  command->add_option("--time-limit", arguments->time_limit, "90s, 10m, 1h: then the answer so far")->type_name("T");
  command->add_option("--holdout", arguments->holdout, "heightmap on which the pick is only tried; may be repeated")
      ->expected(1)
      ->take_all();
  command->add_option("--combine", arguments->combine, "several scenes: weighted sum of their times, or the worst")
      ->check(CLI::IsMember({"weighted", "worst"}))
      ->capture_default_str();
  command->add_option("--weights", arguments->weights, "of the scenes, e.g. 2,1,1")->type_name("W,...");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | null; default: vulkan where it has a device");
  command->add_option("--device", arguments->device, "index on the backend")->capture_default_str();
  command->add_option("--seed", arguments->seed, "of the audits, and of replay's noise")->capture_default_str();
  command->add_option("--replay", arguments->replay, "a recorded sweep (run folder or table.csv) instead of a device")
      ->type_name("RUN");
  add_channel_options(*command, arguments->reading);
  command->add_flag("--retry-failed", arguments->retry_failed,
                    "draw again what failed in an earlier start, also what it died of twice");
  command->add_flag("--quiet", arguments->quiet, "no progress");
  command->add_flag("--json", arguments->json, "tune.json on standard output");
  command->footer(
      "Exit code 1 where nothing meets the bounds, 4 where the precision was not reached. Ctrl-C and SIGTERM end the\n"
      "search with the answer so far.\n"
      "Example:\n"
      "  reliefbench tune rocks --max-error 'e_xy.p99<=0.5' --max-error 'missed_rate<=0.001' --time-limit 3m -o "
      "out/tune");
  command->callback([arguments, &exit_code] { run(*arguments, exit_code); });
}

}  // namespace reliefbench
