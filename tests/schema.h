#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace reliefbench {

/// configs/schema/<name>.schema.json: config | run | results | samples | front
[[nodiscard]] nlohmann::json load_schema(std::string_view name);

/// What the document breaks of the schema, one error a line; "" if it is valid.
[[nodiscard]] std::string schema_errors(const nlohmann::json& document, std::string_view schema_name);

}  // namespace reliefbench
