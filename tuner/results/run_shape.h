#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace reliefbench {

/// Holds run.json to the types of the keys that the program reads; a key may be missing.
/// path: for the message. throws: Error(bad_input) "PATH: key 'devices[0].name': expected a string"
void check_run_shape(const nlohmann::json& info, const std::filesystem::path& path);

}  // namespace reliefbench
