#include "tuner/setting_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "kernels/error.h"

namespace reliefbench {
namespace {

constexpr std::string_view kTechniqueAxis = "technique";

/// A number for each text that a categorical axis can have.
using Values = std::map<std::pair<std::string_view, std::string_view>, int>;
const Values& category_values() {
  static const Values values = [] {
    Values made;
    for (const Technique& technique : techniques()) {
      made.emplace(std::pair(kTechniqueAxis, technique.id), static_cast<int>(made.size()));
      for (const Param& param : technique.params)
        for (const std::string_view choice : param.choices)
          made.emplace(std::pair(param.id, choice), static_cast<int>(made.size()));
    }
    return made;
  }();
  return values;
}

void add_once(std::vector<std::string>& axes, std::string_view id) {
  if (std::ranges::find(axes, id) == axes.end()) axes.emplace_back(id);
}

}  // namespace

SearchSpace empty_setting_space() {
  SearchSpace space;
  add_once(space.category_axes, kTechniqueAxis);
  for (const Technique& technique : techniques())
    for (const Param& param : technique.params)
      add_once(param.choices.empty() ? space.step_axes : space.category_axes, param.id);
  return space;
}

Candidate candidate_of(const SearchSpace& space, const Settings& settings, std::string id) {
  Candidate candidate{.id = std::move(id), .categories = {}, .steps = {}};
  const Technique& technique = settings.technique();
  const auto active = [&](const std::string& axis) {
    const Param* const param = technique.find(axis);
    return param != nullptr && settings.is_active(*param) ? param : nullptr;
  };
  for (const std::string& axis : space.category_axes) {
    const Param* const param = active(axis);
    if (axis == kTechniqueAxis)
      candidate.categories.push_back(category_values().at({kTechniqueAxis, technique.id}));
    else
      candidate.categories.push_back(param == nullptr ? -1 : category_values().at({param->id, settings.choice(axis)}));
  }
  for (const std::string& axis : space.step_axes)
    candidate.steps.push_back(active(axis) == nullptr ? 0 : settings.get(axis));
  return candidate;
}

std::string setting_id(const Settings& settings) {
  const std::string params = settings.text();
  return fmt::format("{}{}{}", settings.technique().id, params.empty() ? "" : "?", params);
}

Settings parse_setting(std::string_view id) {
  const std::size_t question_mark = std::min(id.find('?'), id.size());
  const std::string_view name = id.substr(0, question_mark);
  Settings settings(find_technique(name.substr(0, name.find('@'))));
  for (std::size_t begin = question_mark + 1; begin < id.size();) {
    const std::size_t end = std::min(id.find('&', begin), id.size());
    const std::string_view term = id.substr(begin, end - begin);
    const std::size_t equals = term.find('=');
    if (equals == std::string_view::npos) fail_input("'{}': expected parameter=value, not '{}'", id, term);
    if (term.substr(0, equals) != "backend") settings.set(term.substr(0, equals), term.substr(equals + 1));
    begin = end + 1;
  }
  return settings;
}

}  // namespace reliefbench
