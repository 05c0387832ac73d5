#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "tuner/history/history.h"

namespace reliefbench {

/// A file of Google Benchmark's JSON reporter as a night, without what labels say (ingest.h).
///   - repetitions of a benchmark are its samples; where there are aggregates alone, their median and stddev speak
///   - times are in ns whatever their unit was; counters whose name ends in "per_second" are better when higher
///   - a benchmark that failed or was skipped, and a number that is not finite, has a row that is not valid
///   - its environment: host, CPUs, caches, library; clock rates to 100 MHz, as they are measured anew at each boot
/// unix_s: when it was made; none: as the file says
/// throws: Error(bad_input): not such a file, with its line
[[nodiscard]] Night read_google_benchmark(const std::filesystem::path& path, std::optional<std::int64_t> unix_s);

/// JSON as Google Benchmark writes it: NaN and Infinity, which are no JSON, stand for null.
/// file: for messages. throws: Error(bad_input) "FILE:LINE: ...": a syntax error, over 64 levels
[[nodiscard]] nlohmann::json parse_tolerant_json(std::string_view text, const std::string& file);

}  // namespace reliefbench
