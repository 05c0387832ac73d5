#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace reliefbench {

/// By what cases may move together.
struct CaseTraits {
  std::string technique;
  std::string map;
  std::string format;  ///< "": the technique has none
};

/// "" (all), "technique=...", "map=...", "format=..." with the indices of their cases; without those that are one case,
/// and without any that holds the same cases as an earlier one.
[[nodiscard]] std::vector<std::pair<std::string, std::vector<std::size_t>>> case_groups(
    std::span<const CaseTraits> cases);

}  // namespace reliefbench
