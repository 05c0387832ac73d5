// The pages' scripts are modules, which a page holds as one script.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>

#include "reports/pages/assets.h"
#include "reports/pages/template.h"

namespace reliefbench {
namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ScriptModules, a_page_holds_each_of_its_modules_once_and_before_who_imports_it) {
  for (const char* page : {"report.html", "trend.html", "tuners.html"}) {
    const std::string html = fill_page(page, nlohmann::json::object());
    for (const char* word : {"\nimport ", "\nexport "}) EXPECT_EQ(html.find(word), std::string::npos) << page << word;
    EXPECT_EQ(count_of(html, "const data = JSON.parse("), 1U) << page;
    EXPECT_EQ(count_of(html, "\nfunction make("), 1U) << page;
    EXPECT_LT(html.find("\nfunction make("), html.find("dataset.rendered")) << page;
  }
  // What a page does not import it does not hold: its data has not what that reads.
  EXPECT_EQ(fill_page("trend.html", nlohmann::json::object()).find("drawTechniques"), std::string::npos);
}

TEST(ScriptModules, what_is_imported_is_exported) {
  const std::regex import(R"re(import \{([^}]*)\} from '\./([\w.]+)';)re");
  const std::regex name(R"(\w+)");
  int imports = 0;
  for (const EmbeddedFile& file : embedded_assets()) {
    if (!file.name.ends_with(".js") || file.name == "chart.min.js") continue;
    const std::string text(file.text);
    for (std::sregex_iterator match(text.begin(), text.end(), import), end; match != end; ++match) {
      const std::string names = (*match)[1];
      const std::string from(embedded_text(embedded_assets(), (*match)[2].str()));
      for (std::sregex_iterator one(names.begin(), names.end(), name); one != end; ++one) {
        const std::regex exported("(^|\n)export (async )?(function|const|let|class) " + one->str() + "\\b");
        EXPECT_TRUE(std::regex_search(from, exported)) << file.name << " imports " << one->str();
        ++imports;
      }
    }
  }
  EXPECT_GT(imports, 50);
}

}  // namespace
}  // namespace reliefbench
