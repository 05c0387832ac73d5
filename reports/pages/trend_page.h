#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace reliefbench {

/// One HTML file that needs nothing else: what moved and how sure that is, every series over its nights, the machines'
/// health, the triage log.
/// data: trend_data_json()'s
[[nodiscard]] std::string trend_page(const nlohmann::json& data);

}  // namespace reliefbench
