#include "tuner/plan/registry_params.h"

#include <algorithm>

#include "kernels/trace/technique.h"

namespace reliefbench {

int RegistryParam::index(std::string_view value) const {
  return static_cast<int>(std::ranges::find(values, value) - values.begin());
}

namespace {

/// Whether ids have it only where it is other than usual, or where a parameter is that they have only then.
bool is_unusual(const Param& param) { return !param.is_spelt_out || is_of_scenes_row(param); }

}  // namespace

const std::vector<RegistryParam>& registry_params() {
  static const std::vector<RegistryParam> table = [] {
    std::vector<RegistryParam> list;
    const auto add = [&](const Param& param) {
      auto row = std::ranges::find(list, param.id, &RegistryParam::id);
      if (row == list.end()) row = list.insert(list.end(), {.id = param.id, .values = {}});
      for (const std::string_view choice : param.choices)
        if (std::ranges::find(row->values, choice) == row->values.end()) row->values.push_back(choice);
    };
    for (const bool unusual : {false, true})
      for (const Technique& technique : techniques())
        for (const Param& param : technique.params)
          if (is_unusual(param) == unusual) add(param);
    return list;
  }();
  return table;
}

}  // namespace reliefbench
