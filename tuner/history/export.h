#pragma once
#include <string>

#include "tuner/history/history.h"

namespace reliefbench {

// A view as other programs read it. Those of one night take a view of one run. What is not valid is left out, unless
// the format can say so.

/// Google Benchmark's JSON, which `track ingest` reads, too: a repetition a sample, times in ns. A case of ours has the
/// value that is tracked as counter `relative_time`; what failed has `error_occurred`.
/// view: with samples
[[nodiscard]] nlohmann::json google_benchmark_json(const HistoryView& view);

/// Bencher's metric format: {name: {measure: {value, lower_value, upper_value}}}. Times are the measure `latency`, in
/// ns, what is tracked of a case of ours is `relative-time`; bounds are those of 95 %.
[[nodiscard]] nlohmann::json bencher_json(const HistoryView& view);

/// github-action-benchmark's customSmallerIsBetter: [{name, unit, value, range, extra}], of what is tracked.
/// Series where higher is better are left out.
[[nodiscard]] nlohmann::json github_action_json(const HistoryView& view);

/// Apache Otava's CSV of all nights of a view: time, commit, a column a series with what is tracked of it.
[[nodiscard]] std::string otava_csv(const HistoryView& view);

}  // namespace reliefbench
