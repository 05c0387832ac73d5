#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "kernels/base/folder_lock.h"
#include "tuner/measure/stress.h"

namespace reliefbench {

inline constexpr std::string_view kStressPage = "stress.html";

/// Makes the folder; others are kept out of it for as long as the lock lives.
/// throws: Error(bad_input): unwritable, or another process writes to it
[[nodiscard]] FolderLock prepare_stress_folder(const std::filesystem::path& folder);

/// Writes stress.json, images/<technique>.png (the error map of a technique's worst frame) and stress.html. Every file
/// whole or not at all. throws: Error(bad_input): unwritable
void write_stress(const StressReport& report, const std::filesystem::path& folder);

/// Whether the folder is one of `stress`, and not a run's.
[[nodiscard]] bool is_stress_folder(const std::filesystem::path& folder);

/// What extremes.js draws: stress.json as it was written, and {"pictures": {technique: data URI or null}}.
/// throws: Error(bad_input): no stress.json, a torn one, another schema
[[nodiscard]] nlohmann::json load_stress(const std::filesystem::path& folder);

/// One HTML file of the folder, which needs nothing else. throws: Error(bad_input): as load_stress; unwritable
void write_stress_page(const std::filesystem::path& folder, const std::filesystem::path& output);

}  // namespace reliefbench
