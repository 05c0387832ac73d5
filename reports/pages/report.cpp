#include "reports/pages/report.h"

#include <vector>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "reports/pages/report_data.h"
#include "reports/pages/stress_page.h"
#include "reports/pages/template.h"
#include "reports/pages/tune_page.h"
#include "tuner/results/run_files.h"

namespace reliefbench {

namespace {

std::string with_stress(ReportData made, const std::filesystem::path& stress) {
  if (!stress.empty()) made.data["stress"] = load_stress(stress);
  return fill_page(kReportFile, made.data, made.images);
}

/// throws: Error(bad_input): a tune.json of another version
std::string make_tune_report(const std::filesystem::path& folder, const std::filesystem::path& stress) {
  const nlohmann::json tune = load_tune(folder);
  try {
    return with_stress(tune_page_data(tune, folder), stress);
  } catch (const nlohmann::json::exception& error) {
    fail_input("{}: {}", (folder / kTuneFile).string(), error.what());
  }
}

}  // namespace

std::string make_report(std::span<const Run> runs, const std::filesystem::path& stress) {
  return with_stress(report_data(runs), stress);
}

void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output,
                  const std::filesystem::path& stress) {
  if (folders.size() == 1 && is_tune_folder(folders.front())) {
    write_output(output, make_tune_report(folders.front(), stress));
    return;
  }
  std::vector<Run> runs;
  runs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) runs.push_back(load_run(folder));
  write_output(output, make_report(runs, stress));
}

}  // namespace reliefbench
