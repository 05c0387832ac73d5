#include <fmt/format.h>

#include <filesystem>
#include <memory>

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
  std::string config;
  std::string backend = "all";
  SweepOptions sweep{.output = {}, .backends = {}, .pictures = Pictured::none, .open = open_isolated};
  NightLabels labels;
  CheckArguments check;
  std::string page;  ///< "": in the run's folder
};

/// "out/nights/20261127T030000Z"
fs::path folder_of_tonight() {
  std::string name = utc_text(unix_ns());
  std::erase_if(name, [](char c) { return c == '-' || c == ':'; });
  return fs::path("out/nights") / name;
}

Exit night_command(const NightArguments& arguments) {
  const Config config = load_config(arguments.config);
  SweepOptions sweep = arguments.sweep;
  sweep.backends = choose_backends(arguments.backend);
  if (sweep.output.empty()) sweep.output = folder_of_tonight();
  History history(arguments.check.database, History::Access::write);  // before the work, not after
  const SweepSummary summary = run_sweep(config, sweep);
  const std::string folder = sweep.output.string();
  const Night night = read_night(folder, arguments.labels);
  if (!history.add(night))
    print_error(folder + ": is in the history already");
  else if (const std::string doubt = doubt_of_clock(history, night.run); !doubt.empty())
    print_error(folder + ": " + doubt);
  const CheckedHistory checked = checked_history(arguments.check);
  write_trend_page(checked, arguments.check,
                   arguments.page.empty() ? (sweep.output / "trend.html").string() : arguments.page);
  const Exit answer = print_check(checked, arguments.check);
  return summary.statuses.contains("ok") || answer != Exit::done ? answer : Exit::nothing_measured;
}

}  // namespace

void add_track_night(CLI::App& track, Exit& exit_code) {
  CLI::App* command = track.add_subcommand("night", "sweep, ingest, check and page in one, for cron");
  const auto arguments = std::make_shared<NightArguments>();
  SweepOptions& sweep = arguments->sweep;
  command->add_option("CONFIG", arguments->config, "what to measure, JSON (configs/nightly.json)")->required();
  add_database_option(*command, arguments->check.database);
  command->add_option("-o,--output", sweep.output,
                      "folder of the run; an interrupted one there goes on. Default: out/nights/TIME");
  command->add_option("--page", arguments->page, "the trend page; trend.html in the run's folder")->type_name("FILE");
  command->add_option("--backend", arguments->backend, "opengl | vulkan | null | all (that are real)");
  command->add_option("--device", sweep.device, "index on the backend, see `reliefbench devices`");
  command->add_option("--filter", sweep.filter, "only cases whose id matches this glob");
  add_slowdown_option(*command, sweep.slowdowns);
  add_label_options(*command, arguments->labels);
  add_check_options(*command, arguments->check);
  add_quiet_option(*command, sweep.quiet);
  command->footer(
      "Exit codes are those of `track check`, which looks at all nights of the history.\n"
      "Example:\n  reliefbench track night configs/nightly.json --db history.db --page trend.html \\\n"
      "    --commit \"$(git rev-parse HEAD)\" --parent \"$(git rev-parse HEAD^)\"");
  command->callback([arguments, &exit_code] { exit_code = night_command(*arguments); });
}

}  // namespace reliefbench
