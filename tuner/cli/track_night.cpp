#include <fmt/format.h>

#include <filesystem>

#include "kernels/base/clock.h"
#include "kernels/base/console.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/ingest.h"
#include "tuner/measure/sweep.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

struct NightArguments {
  std::string config;
  fs::path output;
  std::string backend = "all";
  int device = 0;
  std::string filter;
  std::vector<std::string> slowdowns;
  std::string page;
  NightLabels labels;
  std::string time;
  bool quiet = false;
};

/// "out/nights/20261127T030000Z"
fs::path folder_of_tonight() {
  std::string name = utc_text(unix_ns());
  std::erase_if(name, [](char c) { return c == '-' || c == ':'; });
  return fs::path("out/nights") / name;
}

Exit night_command(NightArguments arguments, const CheckArguments& check, const CheckOutput& output) {
  if (arguments.output.empty()) arguments.output = folder_of_tonight();
  if (!arguments.time.empty()) arguments.labels.unix_s = parse_time(arguments.time, "--time");
  const Config config = load_config(arguments.config);
  History history(check.database, History::Access::write);  // before hours of work, not after
  const SweepSummary summary = run_sweep(config, {.output = arguments.output,
                                                  .backends = choose_backends(arguments.backend),
                                                  .device = arguments.device,
                                                  .filter = arguments.filter,
                                                  .pictures = Pictured::none,
                                                  .slowdowns = parse_slowdowns(arguments.slowdowns),
                                                  .quiet = arguments.quiet});
  Night night = read_night(arguments.output, arguments.labels);
  if (!history.add(night))
    print_error(fmt::format("{}: is in the history already", arguments.output.string()));
  const CheckedHistory checked = checked_history(history, check);
  if (!arguments.page.empty()) write_trend_page(checked, check, arguments.page);
  const Exit answer = print_check(checked, check, output);
  return summary.statuses.contains("ok") || answer != Exit::done ? answer : Exit::nothing_measured;
}

}  // namespace

void add_track_night(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("night", "sweep, ingest, check and page in one, for cron");
  const auto arguments = std::make_shared<NightArguments>();
  const auto check = std::make_shared<CheckArguments>();
  const auto output = std::make_shared<CheckOutput>();
  command->add_option("CONFIG", arguments->config, "what to measure (configs/nightly.json)")->required();
  add_database_option(*command, check->database);
  command->add_option("-o,--output", arguments->output,
                      "folder of the run; an interrupted one there goes on. Default: out/nights/TIME");
  command->add_option("--page", arguments->page, "write the trend page, too")->type_name("FILE");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | null | all (that are real)")
      ->capture_default_str();
  command->add_option("--device", arguments->device, "index on the backend")->capture_default_str();
  command->add_option("--filter", arguments->filter, "only cases whose id matches this glob");
  add_label_options(*command, arguments->labels, arguments->time);
  command->add_option("--inject-slowdown", arguments->slowdowns, "multiply a technique's times, to see that it is found")
      ->type_name("TECHNIQUE:FACTOR");
  add_check_options(*command, *check);
  add_check_outputs(*command, *output);
  command->add_flag("--quiet", arguments->quiet, "no progress");
  command->footer(
      "Exit codes are those of `track check`.\n"
      "Example:\n  reliefbench track night configs/nightly.json --db nightly.sqlite --page trend.html \\\n"
      "    --commit \"$(git rev-parse HEAD)\" --parent \"$(git rev-parse HEAD^)\"");
  command->callback(
      [=, &exit_code] { exit_code = static_cast<int>(night_command(*arguments, *check, *output)); });
}

}  // namespace reliefbench
