#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace reliefbench {

[[nodiscard]] std::string_view version();  ///< of reliefbench
[[nodiscard]] std::string_view git_sha();  ///< of the sources it was built from; "unknown" outside a checkout

[[nodiscard]] std::string host_name();  ///< what the machine is called; "unknown" where it has no name

/// The machine: {"name", "kernel", "cpu", "governor", "max_khz", "cores", "os", "memory_bytes"}; "" where unknown.
[[nodiscard]] nlohmann::json host_json();

}  // namespace reliefbench
