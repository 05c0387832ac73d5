#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

namespace reliefbench {

/// The value of a JSON file that this project writes.
/// throws: as read_file(); Error(bad_input) "PATH: ...": torn, not JSON, deeper than kJsonDepthLimit
[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& path);

/// Before the text is parsed, whoever wrote it.
/// throws: Error(bad_input) "NAME: ...": deeper than kJsonDepthLimit
void check_json_depth(std::string_view text, std::string_view name);

}  // namespace reliefbench
