#pragma once
#include "tuner/plan/config.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// Writes front.json, benchmark.json, table.csv and t4.json of a complete run.
void write_results(const Config& config, const Run& run);

}  // namespace reliefbench
