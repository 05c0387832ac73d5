#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

/// What the page shows, by index so that thousands of points stay small. Fronts and picks are made in the page
/// (assets/decide.js), for they move with its budgets; tests hold them to fronts() and recommend().
///   metrics     [{id, unit, lower_is_better, none_is_best, is_column, is_seen (as people see errors), description}]
///   techniques  [{id, description}], in the registry's order
///   scenes      [{id, frame_px [width, height], texel_px (how many pixels a texel covers, or null)}]
///   groups      [{run, backend, device, label}]: one device of one run
///   settings    [{key, technique, name, map, params [[name, value]], features (how many)}]
///   points      [{group, scene, setting, id, mark, time_ns [median, ci_low, ci_high], samples, coverage (of the
///               interval, as text), timer, errors [a value or null a metric], memory_bytes, bake_ns, device_bake_ns
///               (null: not measured), first_draw_ns (null: nothing was compiled), pictures ({frame, reference, error,
///               taps}: index or null; absent where there is none)}]: ok ones
///   effects     [{group, axis, from, to, pairs, coverage, time [median, ci_low, ci_high], errors [the same or null]}]
///   fleet       as `choose` tells it, of at most kFleetSettings settings; {refusal} where it can't; null: one place
///   heat_map    {stops [{value, color}], marks [{description, color}]}
///   taps_map    the same
///   runs        [{folder, info (run.json without the config), budgets, constraints, filter_notes, statuses}]
///   front_metric  id of the metric shown first
/// A budget is {metric, limit, text}. make_report adds `stress`, as load_stress gives it, where it is asked for.
struct ReportData {
  nlohmann::json data;
  std::vector<std::string> images;  ///< data URIs. Of a setting in a scene, those of the first device that has them
};
/// throws: Error(nothing_measured): the runs have no records; Error(bad_input): a metric, budget or setting that is
///         unknown
[[nodiscard]] ReportData report_data(std::span<const Run> runs);

/// {name, key}: what people call a setting. id: as setting_id() gives it. throws: Error(bad_input): none such is known
[[nodiscard]] nlohmann::json setting_name_json(std::string_view id);

[[nodiscard]] ReportData empty_report_data();  ///< of no run: for pages that have something else to tell

}  // namespace reliefbench
