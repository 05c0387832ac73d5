#pragma once
#include <filesystem>
#include <string_view>

#include "reports/pages/report_data.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

inline constexpr std::string_view kTunePage = "tune.html";

/// The report's data of what the search timed, and `tune`: tune_json(), by which the page tells how the pick was found,
/// with the places of its pick and its answers among the points (pick_point, answer_points).
/// folder: where pictures of the settings may lie
[[nodiscard]] ReportData tune_page_data(const TuneResult& result, const std::filesystem::path& folder);

/// Writes tune.html, which needs nothing else: the report of the settings that were timed, the certificate, the front
/// over time, the gap per budget, what was measured, ruled out and assumed. throws: Error(bad_input): unwritable
void write_tune_page(const TuneResult& result, const std::filesystem::path& folder);

}  // namespace reliefbench
