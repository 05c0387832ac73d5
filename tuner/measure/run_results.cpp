#include "tuner/measure/run_results.h"

#include <ostream>

#include "kernels/base/atomic_file.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/harness.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/results/t4.h"

namespace reliefbench {

void write_results(const Config& config, const Run& run) {
  const std::vector<Front> all = fronts(run.records, config.front_error, config.front_constraints);
  write_atomically(run.folder / kFrontFile, fronts_json(all).dump(1) + "\n");
  write_atomically(run.folder / kBenchmarkFile, [&](std::ostream& out) { write_benchmark_json(run.samples, out); });
  const std::vector<TableRow> table = case_table(run);
  write_atomically(run.folder / kTableFile, case_table_csv(table));
  write_atomically(
      run.folder / kT4File,
      t4_json(run, table, config.front_constraints).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
          "\n");
}

}  // namespace reliefbench
