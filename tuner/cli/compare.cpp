#include "tuner/decide/compare.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "kernels/base/atomic_file.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/compare_print.h"
#include "tuner/cli/compare_rerun.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/rerun.h"
#include "tuner/decide/compare_text.h"
#include "tuner/decide/hardware.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

struct CompareArguments {
  std::vector<std::string> runs;
  CompareOptions options{};
  bool across_backends = false;
  std::string error;  ///< of the fronts; "": the runs'
  bool rerun = false;
  RerunArguments again{};
  CompareDetail detail{};
  bool json = false;
  bool markdown = false;
  std::string junit;  ///< a file; "": none
};

bool is_table(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// Whether two runs are of one device, as far as they have a backend in common.
bool are_of_one_device(const Run& base, const Run& now) {
  const auto before = named_devices(base);
  bool has_common = false;
  for (const auto& [backend, device] : named_devices(now)) {
    const auto other = before.find(backend);
    if (other == before.end()) continue;
    has_common = true;
    if (other->second.name != device.name) return false;
  }
  return has_common;
}

void print_warnings(std::span<const std::string> warnings) {
  for (const std::string& warning : warnings) print_warning(warning);
}

Exit compare_one_device(const Run& base, const Run& now, const CompareArguments& arguments) {
  if (!arguments.error.empty())
    fail_input("--error is of several devices' fronts; --metric says what is compared of two runs of one device");
  Comparison comparison = compare_runs(base, now, arguments.options);
  nlohmann::json rerun;
  if (arguments.rerun) rerun = rerun_doubtful(base, now, arguments.options, arguments.again, comparison);
  print_warnings(comparison.warnings);
  const std::string settle = arguments.rerun ? std::string() : settling_command(base, now, comparison);
  if (!arguments.junit.empty()) write_output(arguments.junit, compare_junit(comparison));
  if (arguments.json) {
    nlohmann::json json = comparison_json(comparison);
    json["settle"] = settle.empty() ? nlohmann::json() : nlohmann::json(settle);
    json["rerun"] = rerun;
    print_json(json, 2);
  } else if (arguments.markdown) {
    fmt::print("{}", compare_markdown(comparison, arguments.runs.front(), arguments.runs.back()));
  } else {
    print_comparison(comparison, arguments.detail, settle);
    if (arguments.rerun) print_rerun(rerun);
  }
  return exit_of(comparison);
}

Exit compare_devices(std::span<const FleetRun> runs, const CompareArguments& arguments) {
  if (arguments.rerun)
    fail_input("--rerun measures two runs of one device again; these are of several devices, drivers or backends");
  if (!arguments.junit.empty())
    fail_input("--junit is of two runs of one device: that another device is slower is no failure");
  HardwareOptions options{.across_backends = arguments.across_backends, .confidence = arguments.options.confidence};
  // The first run with constraints asks; a table asks what is usual.
  for (const FleetRun& run : runs) {
    if (run.info.is_null() || !options.constraints.empty()) continue;
    const RunQuestion question = question_of(run.info);
    options.error_metric = question.error_metric;
    options.constraints = question.constraints;
  }
  if (options.constraints.empty()) options.constraints = question_of(nlohmann::json()).constraints;
  if (!arguments.error.empty()) options.error_metric = arguments.error;
  const HardwareComparison comparison = compare_hardware(runs, options);
  print_warnings(comparison.warnings);
  if (arguments.json)
    print_json(hardware_json(comparison, runs), 2);
  else if (arguments.markdown)
    fmt::print("{}", hardware_markdown(comparison, runs));
  else
    print_hardware(comparison, runs, arguments.detail);
  return exit_of(comparison);
}

Exit compare_command(const CompareArguments& arguments) {
  if (arguments.runs.size() != 2 || arguments.across_backends || is_table(arguments.runs[0]) ||
      is_table(arguments.runs[1])) {
    std::vector<FleetRun> runs;
    for (const std::string& path : arguments.runs) runs.push_back(load_fleet_run(path));
    return compare_devices(runs, arguments);
  }
  const Run base = load_run(arguments.runs[0]);
  const Run now = load_run(arguments.runs[1]);
  if (are_of_one_device(base, now)) return compare_one_device(base, now, arguments);
  return compare_devices(std::array{fleet_run(base), fleet_run(now)}, arguments);
}

}  // namespace

void add_compare_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("compare", "what changed between two runs, or how devices differ");
  const auto arguments = std::make_shared<CompareArguments>();
  CompareOptions& options = arguments->options;
  RerunArguments& again = arguments->again;
  command
      ->add_option("RUNS", arguments->runs,
                   "two runs of one device, earlier one first; or runs (or table.csv) of several")
      ->expected(1, -1)
      ->required();
  command
      ->add_option("--metric", options.metric,
                   "frame_time (relative to the control case), frame_time_raw, or an error metric's id")
      ->type_name("ID");
  command->add_option("--threshold", options.threshold, "change that matters, as a share; 0.05")
      ->type_name("SHARE")
      ->check(expect_number("a share above 0, e.g. 0.05", [](double share) { return share > 0; }));
  command->add_flag("--across-drivers", options.across_drivers,
                    "one device with two drivers: the change is named, not refused");
  command->add_flag("--across-backends", arguments->across_backends,
                    "OpenGL against Vulkan, within one run or several");
  command->add_option("--error", arguments->error, "of several devices: the fronts' error; default: the runs'")
      ->type_name("METRIC");
  CLI::Option* rerun = command->add_flag("--rerun", arguments->rerun,
                                         "measure the doubtful cases again, in turns (base, new, new, base)");
  command->add_option("--binary-a", again.binary_a, "with --rerun: the build of BASE; this one")
      ->type_name("FILE")
      ->needs(rerun);
  command->add_option("--binary-b", again.binary_b, "with --rerun: the build of NEW; this one")
      ->type_name("FILE")
      ->needs(rerun);
  add_rounds_option(*command, again.rounds, "of the re-run");
  command->add_option("--rerun-cases", again.most_cases, fmt::format("most cases of the re-run; {}", again.most_cases))
      ->type_name("N")
      ->check(above_zero());
  command->add_option("-o,--output", again.output, "folder of the re-runs; those that are there count")
      ->type_name("DIR");
  command->add_flag("--all", arguments->detail.all, "every case, not only the changed ones");
  add_names_option(*command, arguments->detail.names);
  command->add_flag("--quiet", again.quiet, "no progress of the re-run");
  CLI::Option* json = add_json_option(*command, arguments->json);
  command->add_flag("--markdown", arguments->markdown, "as Markdown, for a pull request")->excludes(json);
  command->add_option("--junit", arguments->junit, "write JUnit XML to a file, too; slower ones fail")
      ->type_name("FILE");
  command->footer(
      "One device twice: each case, and those of a technique, a map, a format and all as one, by the geometric mean\n"
      "of their ratios, which shows smaller changes. `same`: the interval lies within the threshold; `slower`,\n"
      "`faster`: it does not, and chance is no explanation at 5 % for all that was looked at together. Each verdict\n"
      "has a reason, and what is in doubt the command that would settle it.\n"
      "Several devices: ratios with intervals, the order of the settings, the fronts, what differs.\n"
      "Exit code 1 where a case or a group is slower, a case is lost or an error is worse; 4 where the evidence is\n"
      "too little: a group or most cases are unclear, or the new run is unfinished and lacks some; 5 where no case\n"
      "matches; 0 of several devices.\n"
      "Examples:\n"
      "  reliefbench compare out/yesterday out/today --markdown\n"
      "  reliefbench compare out/yesterday out/today --rerun --binary-a old/reliefbench --binary-b new/reliefbench\n"
      "  reliefbench compare out/driver_535 out/driver_550 --across-drivers\n"
      "  reliefbench compare out/quickstart --across-backends\n"
      "  reliefbench compare out/laptop out/desktop out/phone");
  command->callback([arguments, &exit_code] { exit_code = compare_command(*arguments); });
}

}  // namespace reliefbench
