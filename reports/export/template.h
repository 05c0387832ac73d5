#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace reliefbench {

/// What a template is filled with.
struct TemplateValues {
  std::map<std::string, std::string, std::less<>> words{};  ///< stand for @NAME@
  std::set<std::string, std::less<>>
      flags{};  ///< a line that begins with `?FLAG ` stays where it is set, with `!FLAG ` where not
};

/// A template of reports/export/templates, filled. Words may have lines of their own.
/// throws: Error(environment): no such template; a word that has no value
[[nodiscard]] std::string filled_template(std::string_view name, const TemplateValues& values);

}  // namespace reliefbench
