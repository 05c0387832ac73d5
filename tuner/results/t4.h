#pragma once
#include <iosfwd>
#include <span>

#include "tuner/plan/config.h"
#include "tuner/results/case_table.h"

namespace reliefbench {

/// t4.json: the run in the auto-tuning community's T4 format, version 1.0.0 (results-schema.json and
/// metadata-schema.json of github.com/odgaard/TuningSchema, as Kernel Tuner 1.x writes them), one result a case.
/// Times are milliseconds. compilation_time is that of the first draw, 0 where the pipeline came from the cache;
/// nothing is searched, so search_algorithm is 0; what is not booked for each case (framework, validation) is left out.
/// invalidity: "correct" where the case meets the constraints, "correctness" where it was measured and does not,
/// "constraints" where the device lacks what it needs, else "compile", "timeout" or "runtime". correctness: 1 where
/// "correct", 0 elsewhere. rows: case_table(run)
void write_t4(const Run& run, std::span<const TableRow> rows, std::span<const Budget> constraints, std::ostream& out);

}  // namespace reliefbench
