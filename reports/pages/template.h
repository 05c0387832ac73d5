#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace reliefbench {

/// A page of reports/assets with its {{data}}, {{images}}, {{asset.js}} and {{part.html}} put in.
[[nodiscard]] std::string fill_page(std::string_view page, const nlohmann::json& data,
                                    const nlohmann::json& images = nlohmann::json::array());

}  // namespace reliefbench
