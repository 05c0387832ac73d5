#include "tuner/plan/setting_space.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/plan/registry_params.h"

namespace reliefbench {
namespace {

constexpr std::string_view kTechniqueAxis = "technique";

}  // namespace

std::vector<const MetricRow*> work_metrics() {
  std::vector<const MetricRow*> rows;
  for (const MetricRow& metric : metrics())
    if (metric.counts_work) rows.push_back(&metric);
  return rows;
}

SearchSpace empty_setting_space() {
  SearchSpace space;
  for (const MetricRow* metric : work_metrics()) space.work_axes.emplace_back(metric->id);
  space.category_axes.emplace_back(kTechniqueAxis);
  for (const RegistryParam& param : registry_params())
    (param.values.empty() ? space.step_axes : space.category_axes).emplace_back(param.id);
  return space;
}

Candidate candidate_of(const Settings& settings, std::string id) {
  const Technique& technique = settings.technique();
  Candidate candidate{
      .id = std::move(id), .categories = {static_cast<int>(&technique - techniques().data())}, .steps = {}};
  candidate.work.assign(work_metrics().size(), 0);
  for (const RegistryParam& param : registry_params()) {
    // What ids do not spell is as if it weren't there.
    const Param* const own = settings.active(param.id);
    const bool is_active = own != nullptr && SettingValue{*own, settings.get(param.id)}.is_written();
    if (param.values.empty())
      candidate.steps.push_back(is_active ? settings.get(param.id) : 0);
    else
      candidate.categories.push_back(is_active ? param.index(settings.choice(param.id)) : -1);
  }
  return candidate;
}

void drop_unused_axes(SearchSpace& space) {
  const auto drop = [&](std::vector<std::string>& axes, auto Candidate::*values, auto unused) {
    for (std::size_t axis = axes.size(); axis-- > 0;) {
      const auto is_used = [&](const Candidate& candidate) { return (candidate.*values)[axis] != unused; };
      if (std::ranges::any_of(space.candidates, is_used)) continue;
      const auto place = static_cast<std::ptrdiff_t>(axis);
      axes.erase(axes.begin() + place);
      for (Candidate& candidate : space.candidates) (candidate.*values).erase((candidate.*values).begin() + place);
    }
  };
  drop(space.category_axes, &Candidate::categories, -1);
  drop(space.step_axes, &Candidate::steps, 0.0);
}

std::string setting_id(const Settings& settings) {
  const std::string params = settings.text();
  return fmt::format("{}{}{}", settings.technique().id, params.empty() ? "" : "?", params);
}

Settings parse_setting(std::string_view id) { return parse_case(id).settings; }

Case parse_case(std::string_view id) {
  const std::size_t question_mark = std::min(id.find('?'), id.size());
  const std::string_view name = id.substr(0, question_mark);
  const std::size_t at = std::min(name.find('@'), name.size());
  Case spec{.settings = Settings(find_technique(name.substr(0, at))),
            .scene_id = std::string(name.substr(std::min(at + 1, name.size()))),
            .backend = {}};
  std::string_view rest = id.substr(std::min(question_mark + 1, id.size()));
  while (!rest.empty()) {
    const std::string_view term = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(term.size() + 1, rest.size()));
    const std::size_t equals = term.find('=');
    if (equals == std::string_view::npos) fail_input("'{}': expected parameter=value, not '{}'", id, term);
    if (term.substr(0, equals) == "backend")
      spec.backend = term.substr(equals + 1);
    else
      spec.settings.set(term.substr(0, equals), term.substr(equals + 1));
  }
  return spec;
}

}  // namespace reliefbench
