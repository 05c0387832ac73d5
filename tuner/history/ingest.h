#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "tuner/history/history.h"

namespace reliefbench {

/// What a person or CI knows of a run beside what its files say.
struct NightLabels {
  std::optional<std::string> commit{};  ///< otherwise run.json's git_sha
  std::optional<std::string> parent{};
  std::optional<std::int64_t> unix_s{};  ///< otherwise when the run was started
  std::optional<std::string> machine{};  ///< otherwise the host's name
};

/// A run folder of sweep or tune, or a JSON file that Google Benchmark wrote (1.7 to 1.9: NaN and Infinity as numbers,
/// aggregates beside repetitions, unknown fields).
/// throws: Error(bad_input): neither, or unfinished, with file and line
[[nodiscard]] Night read_night(const std::filesystem::path& path, const NightLabels& labels);

}  // namespace reliefbench
