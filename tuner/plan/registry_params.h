#pragma once
#include <string_view>
#include <vector>

namespace reliefbench {

/// A parameter as all techniques together know it.
struct RegistryParam {
  std::string_view id;
  std::vector<std::string_view> values;  ///< every named value that some technique gives it; empty: an integer

  /// A named value's number: its place in `values`. Not a technique's own number, whose list may be shorter.
  [[nodiscard]] int index(std::string_view value) const;
};

/// Every parameter of the registry once, parameters and values in the order of first appearance; those that ids have
/// only sometimes behind all others.
[[nodiscard]] const std::vector<RegistryParam>& registry_params();

}  // namespace reliefbench
