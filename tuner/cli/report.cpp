#include "reports/report.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "kernels/error.h"
#include "tuner/cli/commands.h"
#include "tuner/run_files.h"

namespace reliefbench {
namespace {

void run_report(const std::vector<std::filesystem::path>& folders, std::filesystem::path output) {
  if (output.empty() && folders.size() > 1) fail_input("report: several runs need --output FILE");
  if (output.empty()) output = folders.front() / kReportFile;
  write_report(folders, output);
  fmt::print("{}\n", output.string());
}

}  // namespace

void add_report_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("report", "write the HTML report of one or more runs");
  const CLI::Option* runs =
      command->add_option("runs", "run folders; several are compared by device")->expected(1, -1)->required();
  const CLI::Option* output =
      command->add_option("-o,--output", "HTML file; RUN/report.html where there is one run")->expected(1);
  command->footer(
      "Examples:\n  reliefbench report out/quickstart\n"
      "  reliefbench report out/llvmpipe out/h200 -o hardware.html");
  command->callback([runs, output, &exit_code] {
    const auto names = runs->as<std::vector<std::string>>();
    run_report({names.begin(), names.end()}, output->empty() ? "" : output->as<std::string>());
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
