#include "reports/pages/report.h"

#include <vector>

#include "kernels/base/atomic_file.h"
#include "reports/pages/report_data.h"
#include "reports/pages/stress_page.h"
#include "reports/pages/template.h"
#include "tuner/results/run_files.h"

namespace reliefbench {

std::string make_report(std::span<const Run> runs, const std::filesystem::path& stress) {
  ReportData made = report_data(runs);
  if (!stress.empty()) made.data["stress"] = load_stress(stress);
  return fill_page(kReportFile, made.data, made.images);
}

void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output,
                  const std::filesystem::path& stress) {
  std::vector<Run> runs;
  runs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) runs.push_back(load_run(folder));
  write_output(output, make_report(runs, stress));
}

}  // namespace reliefbench
