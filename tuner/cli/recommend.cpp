#include "tuner/decide/recommend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/features_option.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/decide/choose.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/frame_size.h"
#include "tuner/plan/config.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/device_json.h"
#include "tuner/results/frame_fill.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

struct RecommendArguments {
  std::string folder;
  std::vector<Budget> max_error;
  std::optional<double> max_time_ms;
  std::optional<int> rebake_every;
  std::string scene;
  std::string features;
  Names names;
  bool json = false;
};

constexpr std::string_view kIndent = "              ";

Question asked_question(const RecommendArguments& arguments, const RunQuestion& own) {
  Question question{.budgets = arguments.max_error, .error_metric = own.error_metric};
  question.max_time_ms = arguments.max_time_ms;
  question.rebake_every = arguments.rebake_every;
  if (!question.budgets.empty()) return question;
  question.budgets = own.budgets;
  if (question.max_time_ms) {
    question.simplest_budgets = own.budgets;
    question.budgets = budgets_beside(own.error_metric, own.budgets);
  }
  return question;
}

void keep_scene(std::vector<Record>& records, const std::string& scene) {
  if (const auto known = scenes_of(records); !known.contains(scene)) fail_scene(scene, known, "the run");
  std::erase_if(records, [&](const Record& record) { return record.scene != scene; });
}

std::string bounds_text(const std::vector<Budget>& budgets) {
  return fmt::format("{}", fmt::join(budget_texts(budgets), " and "));
}

std::string question_text(const Question& question) {
  if (!question.max_time_ms) return fmt::format("The fastest with {}", bounds_text(question.budgets));
  const std::string also = question.budgets.empty() ? "" : " and " + bounds_text(question.budgets);
  return fmt::format("The most accurate ({}) with a frame time up to {} ms{}", question.error_metric,
                     format_number(*question.max_time_ms), also);
}

std::string metric_text(const Record& record, const std::string& metric_id) {
  const std::optional<double> value = metric_value(record, metric_id);
  const std::string_view none = find_metric(metric_id).none_is_best() ? "(identical)" : "(not measured)";
  return fmt::format("{} {}", metric_id, value ? format_number(*value) : none);
}

/// What the map takes, and whose time that is.
std::string rebake_text(const Record& record) {
  return fmt::format("bake {}{}", format_time_ns(rebake_ns(record)), record.device_bake_ns ? " by the device" : "");
}

/// Frame time with its interval, every metric that was asked for, and what the case costs otherwise.
std::string numbers(const Record& record, const Question& question) {
  std::vector<std::string> metric_ids = {question.error_metric, "missed_rate"};
  for (const Budget& budget : question.budgets) metric_ids.push_back(budget.metric);
  std::vector<std::string> parts = {format_interval_ns(record.frame_time->summary)};
  for (std::size_t i = 0; i < metric_ids.size(); ++i) {
    const auto here = metric_ids.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(metric_ids.begin(), here, *here) != here) continue;
    parts.push_back(metric_text(record, *here));
  }
  parts.push_back(fmt::format("taps {} (most {})", format_number(record.error->at("taps.mean")),
                              format_number(record.error->at("taps.max"))));
  parts.push_back(fmt::format("memory {}", format_bytes(record.memory_bytes)));
  if (record.bake_time_ns > 0) parts.push_back(rebake_text(record));
  return fmt::format("{}", fmt::join(parts, "   "));
}

std::string against_pick(const Record& record, const Record& pick, const Question& question) {
  const Summary& summary = record.frame_time->summary;
  return fmt::format("{}, {:.2f}x the pick   {}{}", format_interval_ns(summary),
                     summary.median / pick.frame_time->summary.median, metric_text(record, question.error_metric),
                     question.rebake_every && rebake_ns(record) > 0 ? "   " + rebake_text(record) : "");
}

std::string floor_text(const Record& flat, const Record& pick) {
  if (&flat == &pick) return "the pick itself";
  const double pick_ns = pick.frame_time->summary.median;
  const double flat_ns = flat.frame_time->summary.median;
  return fmt::format("{}; the pick is {:.2f}x, {} {}", format_interval_ns(flat.frame_time->summary), pick_ns / flat_ns,
                     format_time_ns(std::abs(pick_ns - flat_ns)), pick_ns < flat_ns ? "less" : "more");
}

/// What makes a run's config, with a record's scene, of that in a file: "", or --frame-px; none: nothing does.
std::optional<std::string> frame_words(const std::string& path, const Record& record, const Run& run) {
  const nlohmann::json before = run.info.value("config", nlohmann::json());
  const auto is_it = [&](const std::string& text) {
    return nlohmann::json::parse(text, nullptr, false, /*ignore_comments=*/true) == before;
  };
  try {
    const Config config = load_config(path);
    if (is_it(config.text)) return "";
    const MeasuredScene* const scene = find_scene(run.scenes, record.scene_key);
    if (scene == nullptr) return std::nullopt;
    const Size size{scene->spec.scene.width_px, scene->spec.scene.height_px};
    Config asked = config;
    set_frames(asked, size);
    if (is_it(asked.text)) return fmt::format(" --frame-px {}x{}", size.width, size.height);
    Config by_device = config;
    set_default_frames(by_device, {.size_px = size, .why = {}});
    return is_it(by_device.text) ? std::optional(std::string()) : std::nullopt;
  } catch (const Error&) {  // it is no config any more
    return std::nullopt;
  }
}

/// The sweep that measures just this case again; nothing where its config is no file, or not as it was.
std::string again(const Record& record, const Run& run) {
  const std::string path = run.info.value("config_path", "");
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return "";
  const std::optional<std::string> frames = frame_words(path, record, run);
  if (!frames) return "";
  const int index = device_of(run.info, record.backend).value("index", 0);
  const std::string key = setting_key(parse_setting(record.case_id));
  return fmt::format("reliefbench sweep {} --backend {} --device {} --filter {} --case {}{} -o out/again_{}",
                     shell_quoted(path), record.backend, index, shell_quoted(fmt::format("*@{}?*", record.scene)), key,
                     *frames, key);
}

/// Where there is no simpler setting to show: why not.
std::string no_simpler_text(const Answer& answer, const Question& question) {
  if (answer.simplest == nullptr)
    return fmt::format("none within the time meets {}", bounds_text(question.simplest_budgets));
  if (answer.simpler == 0) return "no simpler setting was measured";
  return fmt::format("none of the {} simpler settings does it", answer.simpler);
}

/// Whether a person needs times per pixel to hold its scenes to one another.
bool has_frame_sizes(const Run& run) {
  const auto differs = [&](const MeasuredScene& one) {
    const Scene& first = run.scenes.front().spec.scene;
    return one.spec.scene.width_px != first.width_px || one.spec.scene.height_px != first.height_px;
  };
  return std::ranges::any_of(run.scenes, differs);
}

void print_answer(const Answer& answer, const Question& question, const Run& run, const Names& names,
                  const Paint& paint) {
  put("\n{}\n", paint.bold(fmt::format("{}, {}, {}", answer.scene, answer.backend, answer.device)));
  const CoarseFilter coarse(run.info, answer.backend);
  const auto name_of = [&](const Record& record) {
    return fmt::format("{}{}", names.setting(record.case_id), coarse.mark(record.case_id));
  };
  const auto line = [](std::string_view label, std::string_view text) { put("  {:<12}{}\n", label, text); };
  if (answer.pick == nullptr) {
    line("no pick", paint.bad(answer.miss));
    if (answer.nearest == nullptr) return;
    line("nearest", name_of(*answer.nearest));
    put("{}{}\n", kIndent, numbers(*answer.nearest, question));
    return;
  }
  const Record& pick = *answer.pick;
  line("pick", paint.good(name_of(pick)));
  const std::optional<double> per_px = has_frame_sizes(run) ? ns_per_px(run, pick) : std::nullopt;
  put("{}{}{}\n", kIndent, numbers(pick, question), per_px ? fmt::format("   {} ns/px", format_number(*per_px)) : "");
  const auto other = [&](std::string_view label, const Record& record) {
    line(label, name_of(record));
    put("{}{}\n", kIndent, against_pick(record, pick, question));
  };
  if (answer.tie != nullptr) {
    other("tie", *answer.tie);
    put("{}{}\n", kIndent,
        paint.dim(fmt::format("{} as fast as far as the intervals tell; the pick is the simplest and smallest",
                              answer.ties == 1 ? "it is" : fmt::format("with it {} are", answer.ties))));
  }
  if (answer.runner_up != nullptr && answer.runner_up != answer.tie) other("runner-up", *answer.runner_up);
  if (answer.simplest == nullptr || !(simplicity(*answer.simplest) < simplicity(pick)))
    line("simplest", no_simpler_text(answer, question));
  else
    other("simplest", *answer.simplest);
  if (answer.flat != nullptr) line("flat floor", floor_text(*answer.flat, pick));
  if (const std::string command = again(pick, run); !command.empty())
    put_command(fmt::format("  {:<12}{}", "again", paint.dim(command)));
}

/// What the marks at an answer's settings mean; "" where there is none.
std::string filter_note(const Answer& answer, const Run& run) {
  const CoarseFilter coarse(run.info, answer.backend);
  for (const Record* record : {answer.pick, answer.tie, answer.runner_up, answer.simplest, answer.nearest})
    if (record != nullptr && !coarse.mark(record->case_id).empty()) return coarse.note();
  return "";
}

void print_filter_notes(std::span<const Answer> answers, const Run& run, const Paint& paint) {
  std::set<std::string> notes;
  for (const Answer& answer : answers) notes.insert(filter_note(answer, run));
  notes.erase("");
  for (const std::string& note : notes) put("\n{}\n", paint.dim(note));
}

Exit recommend_command(const RecommendArguments& arguments) {
  Run stored = load_run(arguments.folder);
  const Question question = asked_question(arguments, question_of(stored));
  if (!arguments.scene.empty()) keep_scene(stored.records, arguments.scene);
  if (!arguments.features.empty()) keep_features(stored.records, arguments.features, arguments.folder);
  if (question.rebake_every) add_bakes(stored.records, *question.rebake_every);
  const std::vector<Answer> answers = recommend(stored.records, question);
  if (arguments.json) {
    nlohmann::json json = answers_json(answers, question);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      json["answers"][i]["filter_note"] = filter_note(answers[i], stored);
      const std::optional<double> per_px =
          answers[i].pick != nullptr ? ns_per_px(stored, *answers[i].pick) : std::nullopt;
      json["answers"][i]["ns_per_px"] = per_px ? nlohmann::json(*per_px) : nlohmann::json();
    }
    json["frame_notes"] = small_frame_notes(stored.info);
    print_json(json, 2);
    return exit_of(answers);
  }
  const Paint paint = paint_for_stdout();
  const std::size_t cases = stored.records.size();
  put("{}, of the {} case{} in {}.\n", question_text(question), cases, cases == 1 ? "" : "s", arguments.folder);
  if (is_of_tune(stored))
    put("{}\n", paint.dim("These are the settings that tune answers with; how sure it is of them is in tune.json."));
  put("{}\n", paint.dim("Times: median [its interval; confidence]; judged by the interval's upper end."));
  if (question.rebake_every)
    put("{}\n",
        paint.dim(fmt::format("Each frame bears its share of a bake every {} frame{}: the device's own where it was "
                              "measured, else the processor's, without the upload.",
                              *question.rebake_every, *question.rebake_every == 1 ? "" : "s")));
  for (const Answer& answer : answers) print_answer(answer, question, stored, arguments.names, paint);
  print_filter_notes(answers, stored, paint);
  for (const std::string& note : small_frame_notes(stored.info)) put("\n{}\n", paint.dim(note));
  const Exit result = exit_of(answers);
  if (result == Exit::nothing_measured) print_error(fmt::format("no case of {} was measured", arguments.folder));
  return result;
}

}  // namespace

void add_recommend_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("recommend", "the best technique and settings within a budget");
  const auto arguments = std::make_shared<RecommendArguments>();
  command->add_option("RUN", arguments->folder, "folder of a run")->required();
  add_bounds_option(*command, "--max-error", arguments->max_error,
                    "bound on a metric, e.g. 'e_xy.p99<=0.5'; may be repeated; see `list metrics`");
  command->add_option("--max-time-ms", arguments->max_time_ms, "bound on frame time: then the most accurate within it")
      ->type_name("MS")
      ->check(above_zero());
  command
      ->add_option("--rebake-every", arguments->rebake_every,
                   "the heightmap changes every N frames: each bears its share of the bake")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 30));
  command->add_option("--scene", arguments->scene, "only this scene, e.g. rocks/grazing")->type_name("ID");
  add_features_option(*command, arguments->features);
  add_names_option(*command, arguments->names);
  add_json_option(*command, arguments->json);
  command->footer(
      "Without --max-error: the budgets of the run's config, or what tune was asked; with --max-time-ms those of them\n"
      "that are not on the error itself. Where intervals of time overlap, the pick is the setting with the fewest\n"
      "features and the smallest map, and what it ties with is named.\n"
      "Exit code 1 where nothing meets the bounds.\n"
      "Examples:\n"
      "  reliefbench recommend out/quickstart --max-error 'e_xy.p99<=0.5' --max-error 'missed_rate<=0.001'\n"
      "  reliefbench recommend out/quickstart --max-time-ms 2\n"
      "  reliefbench recommend out/quickstart --rebake-every 4");
  command->callback([arguments, &exit_code] { exit_code = recommend_command(*arguments); });
}

}  // namespace reliefbench
