#include "reports/pages/report.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "kernels/base/error.h"
#include "reports/pages/stress_page.h"
#include "reports/pages/tune_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

struct ReportArguments {
  std::vector<fs::path> folders;
  fs::path stress;
  fs::path output;
};

void report_command(const ReportArguments& arguments) {
  const auto& [folders, stress, output] = arguments;
  const auto extremes = std::ranges::find_if(folders, is_stress_folder);
  if (extremes != folders.end() && (folders.size() > 1 || !stress.empty()))
    fail_input("report: {} holds {} and no run; beside runs it goes after --stress", extremes->string(), kStressFile);
  if (output.empty() && folders.size() > 1) fail_input("report: several runs need --output FILE");
  const bool is_run = extremes == folders.end();
  const std::string_view own = !is_run ? kStressPage : is_tune_folder(folders.front()) ? kTunePage : kReportFile;
  const fs::path page = output.empty() ? folders.front() / own : output;
  if (is_run)
    write_report(folders, page, stress);
  else
    write_stress_page(folders.front(), page);
  put("{}\n", page.string());
}

}  // namespace

void add_report_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("report", "write the HTML report of one or more runs, or of a stress folder");
  const auto arguments = std::make_shared<ReportArguments>();
  command
      ->add_option("runs", arguments->folders,
                   "run folders; several are compared by device. Or one folder of `tune` or `stress`: its page again")
      ->expected(1, -1)
      ->required();
  command->add_option("--stress", arguments->stress, "folder of `stress`: its matrix as a section of the report");
  command->add_option("-o,--output", arguments->output,
                      "HTML file; default: report.html (tune.html, stress.html) in the folder where there is one");
  command->footer(
      "Examples:\n  reliefbench report out/quickstart\n"
      "  reliefbench report out/quickstart --stress out/stress -o out/report.html\n"
      "  reliefbench report out/llvmpipe out/h200 -o hardware.html");
  command->callback([arguments] { report_command(*arguments); });
}

}  // namespace reliefbench
