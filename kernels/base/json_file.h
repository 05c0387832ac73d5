#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace reliefbench {

/// The value of a JSON file that this project writes.
/// throws: as read_file(); Error(bad_input) "PATH: ...": torn, not JSON, deeper than kJsonDepthLimit
[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& path);

}  // namespace reliefbench
