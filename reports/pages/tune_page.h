#pragma once
#include <filesystem>
#include <string_view>

#include "reports/pages/report_data.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

inline constexpr std::string_view kTunePage = "tune.html";

/// The report's data of what a search timed, and `tune`: its tune.json, by which the page tells how the pick was found,
/// with the places of its pick and its answers among the points (pick_point, answer_points), the budgets that all
/// points are within (kept_budgets, texts) and what its settings are called (names: {name, key} by id). What a search
/// does not know of a point is null; a setting that a folder's records have says which (recorded_in).
/// tune: tune_json(); folder: where pictures of the settings may lie
/// throws: Error(bad_input) names the folder's tune.json: it is none
[[nodiscard]] ReportData tune_page_data(const nlohmann::json& tune, const std::filesystem::path& folder);

/// Whether a folder holds a search: then its page is that of tune_page_data().
[[nodiscard]] bool is_tune_folder(const std::filesystem::path& folder);
/// tune.json of such a folder. throws: Error(bad_input) that names the file
[[nodiscard]] nlohmann::json load_tune(const std::filesystem::path& folder);

/// Writes tune.html, which needs nothing else: the report of the settings that were timed, the certificate, the front
/// over time, the gap per budget, what was measured, ruled out and assumed. throws: Error(bad_input): unwritable
void write_tune_page(const TuneResult& result, const std::filesystem::path& folder);

}  // namespace reliefbench
