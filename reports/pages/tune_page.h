#pragma once
#include <filesystem>
#include <string_view>

#include "tuner/tune/tune.h"

namespace reliefbench {

inline constexpr std::string_view kTunePage = "tune.html";

/// Writes tune.html, which needs nothing else: the answer, the front over time, the gap per budget, what was measured,
/// ruled out and assumed. throws: Error(bad_input): unwritable
void write_tune_page(const TuneResult& result, const std::filesystem::path& folder);

}  // namespace reliefbench
