#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "backends/worker/remote.h"
#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "reports/pages/require_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/setting_options.h"
#include "tuner/measure/frame_size.h"
#include "tuner/measure/require_run.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"

namespace reliefbench {
namespace {

struct RequireArguments {
  std::string scene;
  std::string backend;
  int device = 0;
  std::string visible;
  std::string search;
  std::string output;
  std::optional<Size> frame_px;
  bool quiet = false;
  bool json = false;
};

/// "shadow, penumbra and lod"
std::string spoken(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : i + 1 == words.size() ? " and " : ", ", words[i]);
  return text;
}

std::string price_text(const Summary& price) {
  if (price.n == 0) return std::string(status_id(Status::throttled));
  return fmt::format("{:+.4g} ms [{:+.4g}, {:+.4g}; {}]", price.median * kMsPerNs, price.ci_low * kMsPerNs,
                     price.ci_high * kMsPerNs, coverage_text(price.n));
}

/// Of what was drawn while the device was held back.
std::string throttled(const std::string& held_back) {
  return fmt::format("{}: {}; the same command may find it cooler", status_id(Status::throttled), held_back);
}

/// The answer in a sentence.
std::string sentence(const RequireReport& report) {
  const Budget& visible = report.file.visible;
  const SeenSet& answer = report.at(report.answer);
  const std::string seen = fmt::format("{} {} in {}, the worst of {} view{}; {} is not seen", visible.metric,
                                       format_number(answer.value), report.file.scenes[answer.view].id,
                                       report.views.size(), report.views.size() == 1 ? "" : "s", visible.text());
  const std::vector<std::string> needed = report.names(report.answer);
  if (!report.is_met)
    return fmt::format("No set of features draws {} unseen: the nearest has {} ({}).", report.file.name,
                       needed.empty() ? "none" : spoken(needed), seen);
  std::vector<std::string> others;
  for (const FeatureWorth& worth : report.worth)
    if (!worth.is_needed) others.push_back(worth.name);
  return fmt::format("{} requires {}{} ({}).", report.file.name,
                     needed.empty() ? "nothing but plain normal mapping" : spoken(needed),
                     others.empty() ? "" : fmt::format("; nobody would miss {}", spoken(others)), seen);
}

void print_worth(const RequireReport& report, const Paint& paint) {
  const std::string& metric = report.file.visible.metric;
  std::vector<std::vector<std::string>> rows{{paint.dim("feature"), paint.dim("by"), paint.dim("required"),
                                              paint.dim(metric + " without"), paint.dim("with"),
                                              paint.dim("price of a frame")}};
  for (const FeatureWorth& worth : report.worth)
    rows.push_back({worth.name, worth.choice, worth.is_needed ? paint.good("yes") : "no",
                    format_number(report.at(worth.without).value), format_number(report.at(worth.with).value),
                    price_text(worth.price_ns)});
  put("\n{}", columns(rows, "  "));
}

/// What is seen by nobody either way, and makes frames faster.
void print_savers(const RequireReport& report) {
  for (const FeatureWorth& worth : report.worth)
    if (report.is_met && !worth.is_needed && worth.price_ns.n > 0 && worth.price_ns.ci_high < 0 &&
        within(report.at(worth.with).value, report.file.visible))
      put("{} would save {:.3g} ms, and nobody would see it.\n", worth.name, -worth.price_ns.median * kMsPerNs);
}

void print_rows(const RequireReport& report, const Paint& paint) {
  std::string text;
  for (const TriedRow& row : report.rows)
    if (std::ranges::count(report.rows, row.feature, &TriedRow::feature) > 1)
      text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", row.choice, format_number(row.value),
                          row.is_chosen ? " (chosen)" : "");
  if (!text.empty())
    put("{}\n", paint.dim(fmt::format("Of rows that bring the same the nearest to the reference stands for them, {} "
                                      "alone over the displaced relief: {}",
                                      report.file.visible.metric, text)));
}

void print_report(const RequireReport& report, const Paint& paint) {
  put("{}\n", paint.bold(sentence(report)));
  const SeenSet& answer = report.at(report.answer);
  put("  {}: {}\n", named(answer.settings),
      report.times_held_back.empty() ? format_interval_ns(report.frame_time_ns) : throttled(report.times_held_back));
  print_worth(report, paint);
  put("\n");
  print_savers(report);
  if (report.ties.size() > 1)
    put("{} sets of as few features are not seen either; {}.\n", report.ties.size(),
        report.ties_held_back.empty() ? "this one is the fastest"
                                      : "which is the fastest is not known, " + throttled(report.ties_held_back));
  print_rows(report, paint);
  for (const FailedSetting& failed : report.failed)
    put("{} can't be drawn, and counts as seen: {}\n", named(failed.settings), failed.reason);
  put("{}\n",
      paint.dim(fmt::format("Held against exact hits with every feature exact, over all views, of which the worst "
                            "decides. {} of {} sets were drawn{}. Price: frame time with it less without, drawn in "
                            "turns, mean over the views, median of {} [interval]. {}, {}{}",
                            report.seen.size(), report.sets, report.is_exhaustive ? "" : ", greedily both ways",
                            report.file.measure.samples, report.backend, report.device,
                            report.is_software ? " (a software rasteriser: prices are the processor's)" : "")));
  if (const std::vector<std::string> needed = report.names(report.answer); report.is_met && !needed.empty())
    put_command(fmt::format("reliefbench tune {} --features {}", shell_quoted(report.file.path.string()),
                            fmt::join(needed, ",")));
  put_command(fmt::format("reliefbench export {} --case {} -o out/shipped", scene_words(report.file.scenes.front()),
                          shell_quoted(setting_id(answer.settings))));
}

RequireSearch parse_search(const std::string& text) {
  if (text == "exhaustive") return RequireSearch::exhaustive;
  return text == "greedy" ? RequireSearch::greedy : RequireSearch::automatic;
}

Exit require_command(const RequireArguments& arguments) {
  SceneFile file = load_scene_file(arguments.scene);
  if (!arguments.visible.empty()) {
    file.visible = parse_budget(arguments.visible);
    check_visible(file.visible);
  }
  if (arguments.frame_px) set_frames(file.scenes, *arguments.frame_px);
  std::string backend = arguments.backend;
  if (backend.empty()) backend = choose_backends("all").back();
  const RequireReport report = run_require(file, {.backend = choose_backends(backend).front(),
                                                  .device = arguments.device,
                                                  .search = parse_search(arguments.search),
                                                  .has_pictures = !arguments.output.empty(),
                                                  .quiet = arguments.quiet,
                                                  .open = open_isolated});
  if (!arguments.output.empty()) write_require(report, arguments.output);
  if (arguments.json) {
    print_json(require_json(report), 1);
  } else {
    print_report(report, paint_for_stdout());
    if (!arguments.output.empty()) put("page: {}/{}\n", arguments.output, kRequirePage);
  }
  return report.is_met ? Exit::done : Exit::answer_is_no;
}

}  // namespace

void add_require_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("require", "what a scene requires: features that nobody would miss, prices");
  const auto arguments = std::make_shared<RequireArguments>();
  command
      ->add_option("SCENE", arguments->scene,
                   "a scene file, e.g. configs/scenes/wall.json (configs/schema/scene.schema.json)")
      ->required();
  command
      ->add_option("--visible", arguments->visible,
                   "what nobody sees, e.g. 'flip<=0.01'; default: the scene's, else that")
      ->type_name("BOUND");
  command->add_option("--backend", arguments->backend,
                      "opengl | vulkan | null; default: the last one that has a device");
  command->add_option("--device", arguments->device, "index on the backend; default: 0");
  command
      ->add_option("--search", arguments->search,
                   fmt::format("exhaustive: every set of features; greedy: both ways; default: every set where there "
                               "are at most {}",
                               kMostEnumerated))
      ->check(CLI::IsMember({"auto", "exhaustive", "greedy"}));
  command->add_option("-o,--output", arguments->output, "folder for require.json, require.html and pictures")
      ->type_name("FOLDER");
  add_frame_option(*command, arguments->frame_px);
  add_quiet_option(*command, arguments->quiet);
  add_json_option(*command, arguments->json);
  command->footer(
      "Features are taken away one by one (displacement itself, shadow, its penumbra, levels, fading, ...), and every\n"
      "set's picture is held against the exact reference that has them all, in every view; the worst view decides.\n"
      "Exit code 1 where no set is within the bound.\n"
      "Example:\n"
      "  reliefbench require configs/scenes/wall.json --visible 'flip<=0.01' -o out/wall");
  command->callback([arguments, &exit_code] { exit_code = require_command(*arguments); });
}

}  // namespace reliefbench
