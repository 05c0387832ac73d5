#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/decide/compare.h"
#include "tuner/decide/hardware.h"

namespace reliefbench {

/// "36 slower, 0 faster, 150 same, 3 unclear of 189 cases"
[[nodiscard]] std::string count_text(const Comparison& comparison);

/// Why cases and groups are unclear, most frequent first: "12 too_few_samples: the samples are ..."
[[nodiscard]] std::vector<std::string> doubt_texts(const Comparison& comparison);

/// A comparison as a table for a pull request: whole and groups, the cases that changed, what the runs differ in.
[[nodiscard]] std::string compare_markdown(const Comparison& comparison, std::string_view base, std::string_view now);
[[nodiscard]] std::string hardware_markdown(const HardwareComparison& comparison, std::span<const FleetRun> runs);
/// "front", "3.1 % slower", "0.4 % slower (?)": no slower as far as can be told; with the mark of a coarse
/// sampler that its error there rests on. column: of its scene
[[nodiscard]] std::string front_text(const FrontSetting& one, std::size_t column);

/// JUnit XML: a test case a group, a case, a worse error and a lost case; slower, worse and lost ones fail, unclear
/// ones are skipped with their reason.
[[nodiscard]] std::string compare_junit(const Comparison& comparison);

}  // namespace reliefbench
