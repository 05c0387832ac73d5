#include <fmt/format.h>

#include <filesystem>

#include "backends/worker/remote.h"
#include "kernels/base/clock.h"
#include "kernels/base/console.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/measure/sweep.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

struct NightArguments {
  Config config;
  SweepOptions sweep;
  NightLabels labels;
  CheckArguments check;
  std::string page;
};

/// "out/nights/20261127T030000Z"
fs::path folder_of_tonight() {
  std::string name = utc_text(unix_ns());
  std::erase_if(name, [](char c) { return c == '-' || c == ':'; });
  return fs::path("out/nights") / name;
}

Exit night_command(const NightArguments& arguments) {
  History history(arguments.check.database, History::Access::write);  // before the work, not after
  const SweepSummary summary = run_sweep(arguments.config, arguments.sweep);
  const std::string folder = arguments.sweep.output.string();
  const Night night = read_night(folder, arguments.labels);
  if (!history.add(night))
    print_error(folder + ": is in the history already");
  else if (const std::string doubt = doubt_of_clock(history, night.run); !doubt.empty())
    print_error(folder + ": " + doubt);
  const CheckedHistory checked = checked_history(arguments.check);
  write_trend_page(checked, arguments.check, arguments.page);
  const Exit answer = print_check(checked, arguments.check);
  return summary.statuses.contains("ok") || answer != Exit::done ? answer : Exit::nothing_measured;
}

}  // namespace

void add_track_night(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("night", "sweep, ingest, check and page in one, for cron");
  const CLI::Option* config = command->add_option("CONFIG", "what to measure, JSON (configs/nightly.json)")->required();
  const CLI::Option* database = add_database_option(*command);
  const CLI::Option* output = command->add_option(
      "-o,--output", "folder of the run; an interrupted one there goes on. Default: out/nights/TIME");
  const CLI::Option* page =
      command->add_option("--page", "the trend page; trend.html in the run's folder")->type_name("FILE");
  const CLI::Option* backend = command->add_option("--backend", "opengl | vulkan | null | all (that are real)");
  const CLI::Option* device = command->add_option("--device", "index on the backend, see `reliefbench devices`");
  const CLI::Option* filter = command->add_option("--filter", "only cases whose id matches this glob");
  const CLI::Option* slowdowns = add_slowdown_option(*command);
  const LabelOptions labels = add_label_options(*command);
  const CheckOptions options = add_check_options(*command);
  const CLI::Option* quiet = add_switch(*command, "--quiet", "no progress");
  command->footer(
      "Exit codes are those of `track check`, which looks at all nights of the history.\n"
      "Example:\n  reliefbench track night configs/nightly.json --db history.db --page trend.html \\\n"
      "    --commit \"$(git rev-parse HEAD)\" --parent \"$(git rev-parse HEAD^)\"");
  command->callback([=, &exit_code] {
    const fs::path folder = output->empty() ? folder_of_tonight() : fs::path(output->as<std::string>());
    exit_code =
        static_cast<int>(night_command({.config = load_config(config->as<std::string>()),
                                        .sweep = {.output = folder,
                                                  .backends = choose_backends(value_or(backend, std::string("all"))),
                                                  .device = value_or(device, 0),
                                                  .filter = value_or(filter, std::string()),
                                                  .pictures = Pictured::none,
                                                  .slowdowns = slowdowns_of(slowdowns),
                                                  .quiet = is_set(quiet),
                                                  .open = open_isolated},
                                        .labels = labels.labels(),
                                        .check = options.arguments(database, {}),
                                        .page = value_or(page, (folder / "trend.html").string())}));
  });
}

}  // namespace reliefbench
