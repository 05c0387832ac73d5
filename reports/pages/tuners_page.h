#pragma once
#include <filesystem>

#include "tuner/tune/tuners.h"

namespace reliefbench {

/// Writes one HTML file that needs nothing else: regret and hypervolume of each strategy against settings timed.
/// throws: Error(bad_input): unwritable
void write_tuners_page(const TunerComparison& comparison, const std::filesystem::path& path);

}  // namespace reliefbench
