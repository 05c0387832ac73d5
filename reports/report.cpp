#include "reports/report.h"

#include <vector>

#include "kernels/error.h"
#include "reports/assets.h"
#include "reports/report_data.h"

namespace reliefbench {
namespace {

// The template names what goes where: {{data}}, or an asset by its file name. What was put in is not scanned again.
std::string fill_template(std::string_view page, std::string_view data) {
  std::string html;
  for (;;) {
    const std::size_t open = page.find("{{");
    html += page.substr(0, open);
    if (open == std::string_view::npos) return html;
    const std::size_t close = page.find("}}", open);
    if (close == std::string_view::npos) fail_environment("report.html: '{{{{' without '}}}}'");
    const std::string_view name = page.substr(open + 2, close - open - 2);
    html += name == "data" ? data : embedded_text(embedded_assets(), name);
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

std::string make_report(std::span<const Run> runs) {
  return fill_template(embedded_text(embedded_assets(), "report.html"), script_safe_json(report_data(runs)));
}

void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output) {
  std::vector<Run> runs;
  runs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) runs.push_back(load_run(folder));
  write_atomically(output, make_report(runs));
}

}  // namespace reliefbench
