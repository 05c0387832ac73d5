#pragma once
#include <span>
#include <string>
#include <string_view>

#include "reports/export/shipped_shader.h"

namespace reliefbench {

/// A shipped shader in a language.
struct ShippedText {
  std::string library;  ///< relief_trace and relief_normal, with what they need; "": the language has none
  std::string example;  ///< a whole fragment shader with them
};

/// A language that shaders ship in.
struct Language {
  std::string_view id;
  std::string_view name;
  std::string_view library_file;  ///< "": only the example
  std::string_view example_file;
  std::string_view written_by;  ///< what translates the source
  ShippedText (*write)(const ShippedShader& shipped);
};
[[nodiscard]] std::span<const Language> languages();
[[nodiscard]] const Language& find_language(std::string_view id);  ///< throws: Error(bad_input) listing the choices

}  // namespace reliefbench
