#pragma once
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace reliefbench {

/// Data of a page whose every text begins with what would run, if it were HTML: `data-hacked` of the body tells. Texts
/// of the keys in `kept` stay as they are: the page looks something up by them.
inline nlohmann::json hostile(nlohmann::json data, const std::set<std::string_view>& kept, std::string_view key = {}) {
  constexpr const char* kHostile =
      R"(</script><script>document.body.dataset.hacked = 1</script><img src=x onerror="document.body.dataset.hacked=1"><!-- '&amp; )";
  if (data.is_string()) return kept.contains(key) ? data : nlohmann::json(kHostile + data.get<std::string>());
  if (!data.is_structured()) return data;
  for (auto& [name, value] : data.items()) value = hostile(std::move(value), kept, data.is_object() ? name : key);
  return data;
}

/// The same of a whole page.
inline std::string hostile_page(std::string html, const std::set<std::string_view>& kept) {
  constexpr std::string_view kBegin = R"(<script type="application/json" id="data">)";
  const std::size_t begin = html.find(kBegin) + kBegin.size();
  const std::size_t end = html.find("</script>", begin);
  std::string text = hostile(nlohmann::json::parse(html.substr(begin, end - begin)), kept).dump();
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) text.replace(at, 1, "\\u003c");
  return html.replace(begin, end - begin, text);
}

}  // namespace reliefbench
