#include "reports/pages/template.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "kernels/base/error.h"
#include "reports/pages/assets.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

/// A script with the modules that it imports, each once and before who imports it, as one script: without `import` and
/// `export`, so that all names are in one scope. Modules that import each other may do so in functions only.
std::string bundle(std::string_view name, std::set<std::string, std::less<>>& seen) {
  constexpr std::string_view kImport = "import ";
  constexpr std::string_view kExport = "export ";
  std::string imported;
  std::string own;
  std::string_view text = embedded_text(embedded_assets(), name);
  seen.emplace(name);
  while (!text.empty()) {
    // An import may take several lines, and ends in `from './NAME';`.
    const bool is_import = text.starts_with(kImport);
    const std::size_t end = std::min(text.find(is_import ? ";\n" : "\n"), text.size() - 1) + (is_import ? 2 : 1);
    std::string_view line = text.substr(0, end);
    text.remove_prefix(line.size());
    if (is_import) {
      const std::size_t from = line.rfind("'./") + 3;
      const std::string_view module = line.substr(from, line.rfind('\'') - from);
      if (!seen.contains(module)) imported += bundle(module, seen);
      continue;
    }
    if (line.starts_with(kExport)) line.remove_prefix(kExport.size());
    own += line;
  }
  return imported + own;
}

struct PageTexts {
  std::string data;
  std::string images;
};

// The template names what goes where: {{data}}, {{images}}, or an asset by its file name. Of what is put in, only parts
// of pages (.html) are templates themselves.
std::string fill_template(std::string_view page, const PageTexts& texts) {
  std::string html;
  for (;;) {
    const std::size_t open = page.find("{{");
    html += page.substr(0, open);
    if (open == std::string_view::npos) return html;
    const std::size_t close = page.find("}}", open);
    if (close == std::string_view::npos) fail_environment("a page has '{{{{' without '}}}}'");
    const std::string_view name = page.substr(open + 2, close - open - 2);
    if (name == "data") {
      html += texts.data;
    } else if (name == "images") {
      html += texts.images;
    } else if (name.ends_with(".html")) {
      html += fill_template(embedded_text(embedded_assets(), name), texts);
    } else if (name.ends_with(".js")) {
      std::set<std::string, std::less<>> seen;
      html += bundle(name, seen);
    } else {
      html += embedded_text(embedded_assets(), name);
    }
    page.remove_prefix(close + 2);
  }
}

// JSON inside HTML: '<' can only be in strings, where its escape means the same; so no "</script>" or "<!--" is left.
std::string script_safe_json(const nlohmann::json& data) {
  std::string text;
  // File names, and so case ids, need not be UTF-8.
  for (const char c : json_text(data, -1)) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

}  // namespace

std::string fill_page(std::string_view page, const nlohmann::json& data, const nlohmann::json& images) {
  return fill_template(embedded_text(embedded_assets(), page),
                       {.data = script_safe_json(data), .images = script_safe_json(images)});
}

}  // namespace reliefbench
