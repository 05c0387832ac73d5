#pragma once
#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace reliefbench {

/// Settings and cases as a command prints them: short and with their key, or by their whole ids.
struct Names {
  bool verbose = false;

  /// id: setting_id() or a case's id. "cone cone_steps=64 [4cc2dca1]"
  [[nodiscard]] std::string setting(std::string_view id) const;
  /// "cone cone_steps=64 [4cc2dca1] in rocks/grazing, opengl"
  [[nodiscard]] std::string whole_case(std::string_view case_id) const;
};

/// Adds --verbose.
void add_names_option(CLI::App& command, Names& names);

}  // namespace reliefbench
