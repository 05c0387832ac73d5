#include "tuner/cli/names.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {

std::string Names::setting(std::string_view id) const {
  const Settings settings = parse_setting(id);
  return verbose ? setting_id(settings) : named(settings);
}

std::string Names::whole_case(std::string_view case_id) const {
  if (verbose) return std::string(case_id);
  const Case spec = parse_case(case_id);
  return fmt::format("{} in {}, {}", named(spec.settings), spec.scene_id, spec.backend);
}

void add_names_option(CLI::App& command, Names& names) {
  command.add_flag("--verbose", names.verbose, "settings by their whole ids");
}

}  // namespace reliefbench
