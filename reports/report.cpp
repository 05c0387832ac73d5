#include "reports/report.h"

#include <vector>

#include "kernels/atomic_file.h"
#include "reports/report_data.h"
#include "reports/stress_page.h"
#include "reports/template.h"
#include "tuner/run_files.h"

namespace reliefbench {

std::string make_report(std::span<const Run> runs, const std::filesystem::path& stress) {
  nlohmann::json data = report_data(runs);
  if (!stress.empty()) data["stress"] = load_stress(stress);
  return fill_page(kReportFile, data);
}

void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output,
                  const std::filesystem::path& stress) {
  std::vector<Run> runs;
  runs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) runs.push_back(load_run(folder));
  write_atomically(output, make_report(runs, stress));
}

}  // namespace reliefbench
