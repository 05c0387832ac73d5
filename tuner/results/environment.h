#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace reliefbench {

/// Where and with what a run measured on one of its backends, as its run.json says it: id and value. What it does not
/// say is left out; a table says nothing.
using Environment = std::vector<std::pair<std::string, std::string>>;

/// backend: "" = what all backends of the run share
/// info: run.json, null for a table
[[nodiscard]] Environment measured_environment(const nlohmann::json& info, std::string_view backend);

/// The value of a trait; "" where it is not known.
[[nodiscard]] std::string_view trait(const Environment& environment, std::string_view id);

/// A trait in which environments differ.
struct EnvironmentDifference {
  std::string what;
  std::vector<std::string> values;  ///< parallel to the environments; "" = not recorded
};
/// Of two or more environments; traits that only one of them knows are no difference.
[[nodiscard]] std::vector<EnvironmentDifference> environment_differences(std::span<const Environment> environments);

[[nodiscard]] nlohmann::json environment_json(std::span<const EnvironmentDifference> differences);

}  // namespace reliefbench
