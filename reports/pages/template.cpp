#include "reports/pages/template.h"

#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "reports/pages/assets.h"

namespace reliefbench {
namespace {

// The template names what goes where: {{data}}, or an asset by its file name. Of what is put in, only parts of pages
// (.html) are templates themselves.
std::string fill_template(std::string_view page, std::string_view data) {
  std::string html;
  for (;;) {
    const std::size_t open = page.find("{{");
    html += page.substr(0, open);
    if (open == std::string_view::npos) return html;
    const std::size_t close = page.find("}}", open);
    if (close == std::string_view::npos) fail_environment("a page has '{{{{' without '}}}}'");
    const std::string_view name = page.substr(open + 2, close - open - 2);
    const std::string_view text = name == "data" ? data : embedded_text(embedded_assets(), name);
    html += name.ends_with(".html") ? fill_template(text, data) : text;
    page.remove_prefix(close + 2);
  }
}

// JSON inside HTML: '<' can only be in strings, where its escape means the same; so no "</script>" or "<!--" is left.
std::string script_safe_json(const nlohmann::json& data) {
  std::string text;
  // File names, and so case ids, need not be UTF-8.
  for (const char c : data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

}  // namespace

std::string fill_page(std::string_view page, const nlohmann::json& data) {
  return fill_template(embedded_text(embedded_assets(), page), script_safe_json(data));
}

}  // namespace reliefbench
