#include "reports/report.h"

#include <vector>

#include "kernels/atomic_file.h"
#include "reports/report_data.h"
#include "reports/template.h"

namespace reliefbench {
std::string make_report(std::span<const Run> runs) { return fill_page("report.html", report_data(runs)); }

void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output) {
  std::vector<Run> runs;
  runs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) runs.push_back(load_run(folder));
  write_atomically(output, make_report(runs));
}

}  // namespace reliefbench
