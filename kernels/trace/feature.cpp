#include "kernels/trace/feature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "kernels/trace/technique.h"

namespace reliefbench {

const std::vector<Feature>& all_features() {
  static const std::vector<Feature> table{
      {.id = "refinement",
       .description = "how the bracket round the hit is narrowed",
       .rows = {{.id = "none", .description = "not at all: its far end is the hit", .shader = "refinement.glsl"},
                {.id = "secant",
                 .description = "where the line through its ends meets the surface, time and again (regula falsi)",
                 .source = "[RIS05]",
                 .params = {range_param("secant_steps", "probes of the secant search before its last interpolation", 0,
                                        32, 1)},
                 .shader = "refinement.glsl"},
                {.id = "binary",
                 .description = "by halving",
                 .source = "[RTM] listing 5.3",
                 .params = {range_param("binary_steps", "halvings of the bracket", 0, 32, 6)},
                 .shader = "refinement.glsl"}}},
      {.id = "filter",
       .description = "the sampler's bilinear filter, or four fetches with full-precision weights",
       .rows = {{.id = "hardware",
                 .description = "the sampler's, whose weights have 8 bits on most devices",
                 .caveat = "on a sampler that is off by no more than its steps make up for"},
                {.id = "manual", .description = "four fetches, weighted in full precision"}},
       .constant_id = kFilterConstant,
       .is_of_all = true},
  };
  return table;
}

std::vector<Param> params_of(const FeatureUse& use) {
  const auto feature = std::ranges::find(all_features(), use.feature, &Feature::id);
  assert(feature != all_features().end());
  std::vector<std::string_view> ids;
  for (const FeatureRow& row : feature->rows) ids.push_back(row.id);
  Param choice =
      choice_param(feature->id, feature->description, ids, use.fallback.empty() ? ids.front() : use.fallback);
  choice.active_if = use.active_if;
  choice.constant_id = feature->constant_id;
  choice.is_spelt_out = feature->is_spelt_out;
  assert(choice.is_spelt_out || choice.fallback == 0);
  std::vector<Param> params{std::move(choice)};
  for (std::size_t i = feature->rows.size(); i-- > 0;)
    for (Param param : feature->rows[i].params) {
      param.active_if = fmt::format("{}={}", feature->id, feature->rows[i].id);
      const auto other = std::ranges::find(use.fallbacks, param.id, &std::pair<std::string_view, int>::first);
      if (other != use.fallbacks.end()) param.fallback = other->second;
      params.push_back(std::move(param));
    }
  return params;
}

std::vector<const FeatureRow*> rows_of(const Settings& settings) {
  std::vector<const FeatureRow*> rows;
  for (const Feature& feature : all_features())
    if (settings.active(feature.id) != nullptr)
      rows.push_back(&feature.rows.at(static_cast<std::size_t>(settings.get(feature.id))));
  return rows;
}

std::string lacking(const std::vector<const FeatureRow*>& rows, const Settings& settings) {
  for (const FeatureRow* row : rows)
    if (row->lacks != nullptr)
      if (std::string what = row->lacks(settings); !what.empty()) return what;
  return "";
}

}  // namespace reliefbench
