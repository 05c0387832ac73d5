#include "kernels/trace/technique.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/suggest.h"
#include "kernels/trace/storage_params.h"
#include "kernels/trace/technique_rows.h"

namespace reliefbench {
namespace {

bool is_feature_of_scene(std::string_view param_id) {
  return std::ranges::any_of(all_features(),
                             [&](const Feature& feature) { return feature.is_of_scene && feature.id == param_id; });
}

/// Appends what the technique spans beside its own, and gives its run-time parameters their specialization constants.
Technique assembled(Technique technique) {
  std::vector<Param>& params = technique.params;
  if (technique.storage) {
    const std::vector<Param> storage = storage_params(technique.maps, *technique.storage);
    params.insert(params.end(), storage.begin(), storage.end());
  }
  const auto append_features = [&](bool of_scene) {
    for (const Feature& feature : all_features()) {
      if (!feature.is_of_all || feature.is_of_scene != of_scene) continue;
      if ((!technique.reads_map() && feature.needs_map) || technique.find(feature.id) != nullptr) continue;
      const auto own = std::ranges::find(technique.features, feature.id, &FeatureUse::feature);
      const FeatureUse use = own == technique.features.end() ? FeatureUse{.feature = feature.id} : *own;
      if (use.is_absent) continue;
      const std::vector<Param> more = params_of(use);
      params.insert(params.end(), more.begin(), more.end());
    }
  };
  append_features(false);
  auto next = static_cast<int>(kFirstOwnConstant);
  for (Param& param : technique.params)
    if ((param.stage == Stage::run || param.is_constant) && param.constant_id == -1 && !is_feature_of_scene(param.id))
      param.constant_id = next++;
  append_features(true);
  return technique;
}

}  // namespace

const Param* Technique::find(std::string_view param_id) const {
  const auto found = std::find_if(params.begin(), params.end(), [&](const Param& p) { return p.id == param_id; });
  return found == params.end() ? nullptr : &*found;
}

const std::vector<Technique>& techniques() {
  static const std::vector<Technique> table = [] {
    std::vector<Technique> list = technique_rows();
    std::transform(list.begin(), list.end(), list.begin(), assembled);
    return list;
  }();
  return table;
}

const Technique& find_technique(std::string_view id) { return find_row(techniques(), "technique", id); }

std::string_view guarantee_id(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::none:
      return "none";
    case Guarantee::never_skips:
      return "never_skips";
    case Guarantee::exact:
      return "exact";
  }
  return "none";
}

}  // namespace reliefbench
