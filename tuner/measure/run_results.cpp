#include "tuner/measure/run_results.h"

#include <ostream>

#include "kernels/base/atomic_file.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/harness.h"
#include "tuner/results/case_table.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_files.h"
#include "tuner/results/t4.h"

namespace reliefbench {

void write_results(const Config& config, const Run& run) {
  const std::vector<Front> all = fronts(run.records, config.front_error, config.front_constraints);
  write_atomically(run.folder / kFrontFile, json_text(fronts_json(all), 1) + "\n");
  write_atomically(run.folder / kBenchmarkFile, [&](std::ostream& out) { write_benchmark_json(run.samples, out); });
  const std::vector<TableRow> table = case_table(run);
  write_atomically(run.folder / kTableFile, [&](std::ostream& out) { write_case_table(table, out); });
  write_atomically(run.folder / kT4File,
                   [&](std::ostream& out) { write_t4(run, table, config.front_constraints, out); });
}

}  // namespace reliefbench
