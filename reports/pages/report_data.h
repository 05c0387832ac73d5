#pragma once
#include <nlohmann/json.hpp>
#include <span>

#include "tuner/results/store.h"

namespace reliefbench {

/// All that the page shows, by index so that thousands of points stay small. Every table is made here by the same
/// functions as the command line's answers; the page's scripts only draw.
///   metrics     [{id, unit, lower_is_better, none_is_best, is_column, description}]
///   techniques  [{id, description}], in the registry's order
///   scenes      [id]
///   groups      [{run, backend, device, label}]: one device of one run
///   points      [{group, scene, technique, id, params, time_ns [median, ci_low, ci_high], samples, coverage
///               (of the interval, as text), timer, errors [a value or null a metric], breaks [constraint],
///               memory_bytes, bake_ns, first_draw_ns}]: ok ones
///   fronts      [{metric, fronts [{group, scene, points [{point, equivalents [point]}]}]}], a row a metric
///   answers     [{group, scene, pick, tie, runner_up, simplest, flat, nearest (points or null), miss, pictures}]
///   images      [data URI]
///   heat_map    {stops [{e_xy, color}], marks [{description, color}]}
///   runs        [{folder, info (run.json without the config), budgets, constraints, statuses}]
///   front_metric  id of the metric shown first
/// make_report adds `stress`, as load_stress gives it, where it is asked for.
/// throws: Error(nothing_measured): the runs have no records; Error(bad_input): a metric or budget that is unknown
[[nodiscard]] nlohmann::json report_data(std::span<const Run> runs);

[[nodiscard]] nlohmann::json heat_map_json();  ///< `heat_map` above

}  // namespace reliefbench
