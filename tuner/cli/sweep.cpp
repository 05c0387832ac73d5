#include "tuner/measure/sweep.h"

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "backends/worker/remote.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"
#include "tuner/measure/frame_size.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/shard.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

struct SweepArguments {
  std::string config;
  std::string output;
  std::string backend = "all";
  int device = 0;
  std::string filter;
  std::string key;
  std::optional<Size> frame_px;
  std::optional<Shard> shard{};
  Names names;
  std::string pictures = "shown";
  std::string device_bakes = "hardware";
  bool retry_failed = false;
  bool is_uncached = false;
  bool dry_run = false;
  bool quiet = false;
  Slowdowns slowdowns;
  bool json = false;
};

// For the plan's estimate: what a case costs beside its batches, on a software rasteriser (llvmpipe, 2 cores).
constexpr double kPrepareCase_s = 0.25;
constexpr double kBatchesAsLongAsAsked = 2.0;  // warm-up, control and batches that overshoot

double estimated_s(const Config& config, const Plan& plan) {
  const double batches_s = config.measure.samples * config.measure.batch_ms * 1e-3 * kBatchesAsLongAsAsked;
  return static_cast<double>(plan.cases.size()) * (kPrepareCase_s + batches_s);
}

/// The plan or, of a shard, its share, and what that is of the whole.
struct Share {
  Plan plan;
  nlohmann::json json{};  ///< null: the whole
  std::string text{};
};

Share share_of(const Config& config, Plan whole, const std::optional<Shard>& shard) {
  if (!shard) return {.plan = std::move(whole)};
  Plan part = shard_of(whole, config, *shard);
  const std::size_t cases = part.cases.size();
  const std::size_t bakes = part.bakes.size();
  return {.plan = std::move(part),
          .json = {{"index", shard->index},
                   {"of", shard->of},
                   {"cases", cases},
                   {"cases_of_all", whole.cases.size()},
                   {"bakes", bakes},
                   {"bakes_of_all", whole.bakes.size()}},
          .text = fmt::format("shard {} of {}: {} of {} cases, {} of {} bakes", shard->index, shard->of, cases,
                              whole.cases.size(), bakes, whole.bakes.size())};
}

/// frames: in words, how large they are that no scene has a size for; "": every scene has
void print_plan_json(const Config& config, const Share& share, const std::string& frames) {
  const Plan& plan = share.plan;
  std::vector<std::string> ids;
  for (const Case& c : plan.cases) ids.push_back(c.id());
  nlohmann::json out = {{"cases", ids},
                        {"bakes", plan.bakes},
                        {"conflicts", plan.conflicts},
                        {"estimated_software_s", estimated_s(config, plan)}};
  if (!share.json.is_null()) out["shard"] = share.json;
  if (!frames.empty()) out["frames"] = frames;
  print_json(out, 1);
}

void print_plan(const Config& config, const Share& share, const Names& names, const std::string& frames) {
  const Plan& plan = share.plan;
  std::map<std::string, int> groups;
  for (const Case& c : plan.cases)
    groups[fmt::format("{:<8} {:<22} {}", c.backend, c.scene_id, c.settings.technique().id)] += 1;
  for (const Case& c : plan.cases) put("{}\n", names.whole_case(c.id()));
  put("\n{:<8} {:<22} {:<14} cases\n", "backend", "scene", "technique");
  for (const auto& [group, count] : groups) put("{:<46} {:5}\n", group, count);
  put("\n{} cases, {} bakes, about {:.1f} minutes on a software rasteriser\n", plan.cases.size(), plan.bakes.size(),
      estimated_s(config, plan) / 60);
  if (!plan.conflicts.empty())
    put("{} combinations left out, e.g. {}\n", plan.conflicts.size(), plan.conflicts.front());
  for (const std::string& line : {share.text, frames})
    if (!line.empty()) put("{}\n", line);
}

void print_summary(const SweepSummary& summary) {
  std::string statuses;
  for (const auto& [status, count] : summary.statuses) statuses += fmt::format(" {} {}", count, status);
  put("{} cases ({} from an earlier start):{}\n", summary.cases, summary.resumed, statuses);
  put("{} maps baked, {} read from the cache; {} references traced, {} read from the cache; {} shaders compiled, {} "
      "read from the cache\n",
      summary.bakes, summary.bakes_cached, summary.references, summary.references_cached, summary.shaders,
      summary.shaders_cached);
  std::string parts;
  for (std::size_t i = 0; i < kPartIds.size(); ++i)
    parts += fmt::format("{} {:.1f} s, ", kPartIds.at(i), summary.part_s.at(i));
  double harness_s = summary.other_s;
  for (const Part part : {Part::judge, Part::pictures}) harness_s += summary.part_s.at(static_cast<std::size_t>(part));
  put("wall time {:.1f} s: {}other {:.1f} s\njudging, pictures and other: {:.1f} % of it\n", summary.total_s, parts,
      summary.other_s, 100 * harness_s / summary.total_s);
  if (summary.held_back > 0)
    put("blocks during which the device was held back, and which do not count: {} ({})\n", summary.held_back,
        (summary.folder / kBlocksFile).string());
  for (const std::string& note : summary.notes) put("{}\n", note);
  print_next_recommend(summary.folder);
}

/// On stderr, where it is seen beside --json too: how many cases have no time, and why.
void print_failures(const SweepSummary& summary) {
  std::vector<std::string> failed;
  int count = 0;
  for (const auto& [status, cases] : summary.statuses) {
    if (status == status_id(Status::ok)) continue;
    failed.push_back(fmt::format("{} {}", cases, status));
    count += cases;
  }
  if (failed.empty()) return;
  print_error(fmt::format(
      "{} of {} cases failed: {}; the reasons are in {}{}", count, summary.cases, fmt::join(failed, ", "),
      (summary.folder / kResultsFile).string(),
      summary.open > 0
          ? "; the same command tries once more what timed out, was throttled, lost the device or ran out of memory"
          : ""));
}

Pictured pictured_of(std::string_view text) {
  if (text == "all") return Pictured::all;
  return text == "none" ? Pictured::none : Pictured::shown;
}

DeviceBakes device_bakes_of(std::string_view text) {
  if (text == "always") return DeviceBakes::always;
  return text == "never" ? DeviceBakes::never : DeviceBakes::hardware;
}

/// What frames are going to be that no scene has a size for.
std::string frame_choice(const Config& config, const SweepArguments& arguments,
                         std::span<const std::string> backend_ids) {
  return default_frame(chosen_devices(backend_ids, arguments.device), config, arguments.output).why;
}

Exit sweep_command(const SweepArguments& arguments) {
  Config config = load_config(arguments.config);
  if (arguments.frame_px) set_frames(config, *arguments.frame_px);
  const std::vector<std::string> backend_ids = choose_backends(arguments.backend);
  if (arguments.dry_run) {
    const Share share =
        share_of(config, make_plan(config, backend_ids, arguments.filter, arguments.key), arguments.shard);
    const std::string frames =
        has_default_frames(config.scenes) ? frame_choice(config, arguments, backend_ids) : std::string();
    if (arguments.json)
      print_plan_json(config, share, frames);
    else
      print_plan(config, share, arguments.names, frames);
    return Exit::done;
  }
  if (arguments.output.empty()) fail_input("sweep needs an output folder: -o DIR");
  const SweepSummary summary =
      run_sweep(config, {.output = arguments.output,
                         .backends = backend_ids,
                         .device = arguments.device,
                         .filter = arguments.filter,
                         .key = arguments.key,
                         .shard = arguments.shard,
                         .retry_failed = arguments.retry_failed,
                         .pictures = pictured_of(arguments.pictures),
                         .device_bakes = device_bakes_of(arguments.device_bakes),
                         .slowdowns = arguments.slowdowns,
                         .quiet = arguments.quiet,
                         .open = arguments.is_uncached ? open_isolated_uncached : open_isolated});
  if (arguments.json) {
    print_json(load_run(summary.folder).info, 1);
  } else {
    print_summary(summary);
  }
  print_failures(summary);
  return summary.statuses.contains("ok") ? Exit::done : Exit::nothing_measured;
}

}  // namespace

void add_sweep_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("sweep", "measure every case of a config: frame time and error");
  const auto arguments = std::make_shared<SweepArguments>();
  command->add_option("CONFIG", arguments->config, "what to measure, JSON (configs/)")->required();
  command->add_option("-o,--output", arguments->output, "folder of the run; an interrupted run there is continued");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | null | all (that are real)")
      ->capture_default_str();
  command->add_option("--device", arguments->device, "index on the backend, see `reliefbench devices`")
      ->capture_default_str();
  command->add_option("--filter", arguments->filter, "only cases whose id matches this glob, e.g. 'cone@*/grazing*'");
  command->add_option("--case", arguments->key, "only the setting of this key, as other commands print it")
      ->type_name("KEY")
      ->check([](const std::string& text) {
        return is_setting_key(text) ? std::string() : fmt::format("'{}' is no setting's key of eight digits", text);
      });
  add_frame_option(*command, arguments->frame_px);
  command
      ->add_option_function<std::string>(
          "--shard", [&shard = arguments->shard](const std::string& text) { shard = parse_shard(text); },
          "only part I of N of the cases, which go by the maps that they share; `reliefbench merge` joins the parts")
      ->type_name("I/N");
  command->add_flag("--retry-failed", arguments->retry_failed,
                    "draw again what failed in an earlier start, also what failed twice");
  command
      ->add_option("--pictures", arguments->pictures,
                   "shown (what a report shows: fronts, picks and what they are held against) | all | none")
      ->check(CLI::IsMember({"shown", "all", "none"}))
      ->type_name("WHICH")
      ->capture_default_str();
  command
      ->add_option("--device-bakes", arguments->device_bakes,
                   "whose maps are baked by the device, too, to time that: of hardware | always | never")
      ->check(CLI::IsMember({"hardware", "always", "never"}))
      ->type_name("WHICH")
      ->capture_default_str();
  command->add_flag("--no-pipeline-cache", arguments->is_uncached,
                    "compile every shader anew, so that each case has its time of compilation");
  add_slowdown_option(*command, arguments->slowdowns);
  add_names_option(*command, arguments->names);
  command->add_flag("--dry-run", arguments->dry_run, "print the plan: cases, bakes, estimated time");
  add_quiet_option(*command, arguments->quiet);
  command->add_flag("--json", arguments->json, "the plan, or run.json, on standard output");
  command->footer(
      "Examples:\n  reliefbench sweep configs/quickstart.json -o out/quickstart --backend all\n"
      "  reliefbench sweep configs/exhaustive.json --shard 3/8 -o out/shard_3");
  command->callback([arguments, &exit_code] { exit_code = sweep_command(*arguments); });
}

}  // namespace reliefbench
