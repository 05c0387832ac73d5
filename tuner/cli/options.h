#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "kernels/image/heightmap.h"

namespace reliefbench {

/// An option's value, or the fallback where it was not given.
template <typename T>
[[nodiscard]] T value_or(const CLI::Option* option, T fallback) {
  return option->empty() ? fallback : option->as<T>();
}

/// A flag. As std::string, since CLI11's overloads for bound variables compete for a literal description.
inline CLI::Option* add_switch(CLI::App& command, const std::string& name, const std::string& description) {
  return command.add_flag(name, description);
}

[[nodiscard]] inline bool is_set(const CLI::Option* flag) { return flag->count() > 0; }

/// "WIDTHxHEIGHT" into the spec. throws: Error(bad_input)
void set_size(HeightmapSpec& spec, const std::string& text);

}  // namespace reliefbench
