#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace reliefbench {

/// A document as text; what is no UTF-8, as a path's bytes may be, comes as U+FFFD.
/// indent: -1: all in one line
template <typename Json>
[[nodiscard]] std::string json_text(const Json& document, int indent) {
  return document.dump(indent, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
}

}  // namespace reliefbench
