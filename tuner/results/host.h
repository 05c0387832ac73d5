#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace reliefbench {

[[nodiscard]] std::string_view version();  ///< of reliefbench
[[nodiscard]] std::string_view git_sha();  ///< of the sources it was built from; "unknown" outside a checkout

/// The machine: {"cpu", "cores", "os", "memory_bytes"}.
[[nodiscard]] nlohmann::json host_json();

}  // namespace reliefbench
