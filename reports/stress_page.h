#pragma once
#include <filesystem>

#include "tuner/stress.h"

namespace reliefbench {

/// Makes the folder. throws: Error(bad_input): unwritable
void prepare_stress_folder(const std::filesystem::path& folder);

/// Writes stress.json, images/<technique>.png (the error map of a technique's worst frame) and stress.html, which needs
/// nothing else. Every file whole or not at all.
/// throws: Error(bad_input): unwritable
void write_stress(const StressReport& report, const std::filesystem::path& folder);

}  // namespace reliefbench
