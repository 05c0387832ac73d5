#pragma once
#include <nlohmann/json.hpp>
#include <regex>
#include <span>
#include <string>

#include "reports/pages/report.h"
#include "tests/browser.h"

namespace reliefbench {

inline std::string report_of(const Run& run) { return make_report(std::span(&run, 1)); }

/// What a probe left as JSON in result.NAME.
inline nlohmann::json told(const std::string& body, const std::string& name) {
  std::smatch found;
  if (!std::regex_search(body, found, std::regex("data-" + name + "=\"([^\"]*)\""))) return {};
  return nlohmann::json::parse(std::regex_replace(found[1].str(), std::regex("&quot;"), "\""), nullptr, false);
}

}  // namespace reliefbench
