#include "tuner/plan/wanted_features.h"

#include <algorithm>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"

namespace reliefbench {
namespace {

/// Whether a name stands for a row: its feature's, what it brings besides, or "feature=row".
bool is_meant(std::string_view name, const Feature& feature, const FeatureRow& row) {
  if (&row == &feature.rows.front()) return false;
  if (name == feature.id || (!row.also.empty() && name == row.also)) return true;
  return name.size() == feature.id.size() + 1 + row.id.size() && name.starts_with(feature.id) &&
         name.ends_with(row.id) && name[feature.id.size()] == '=';
}

WantedFeature parse_wanted_feature(std::string_view name) {
  if (name == kDisplacement) return {};
  std::vector<std::string_view> known{kDisplacement};
  for (const Feature& feature : all_features()) {
    if (!feature.is_of_scene) continue;
    WantedFeature wanted{.feature = &feature};
    known.push_back(feature.id);
    for (const FeatureRow& row : feature.rows) {
      if (!row.also.empty() && std::ranges::find(known, row.also) == known.end()) known.push_back(row.also);
      if (is_meant(name, feature, row)) wanted.rows.push_back(&row);
    }
    if (!wanted.rows.empty()) return wanted;
    if (name.starts_with(feature.id) && name.substr(feature.id.size()).starts_with('=')) {
      std::vector<std::string_view> rows;
      for (const FeatureRow& row : feature.rows)
        if (&row != &feature.rows.front()) rows.push_back(row.id);
      const std::string_view row = name.substr(feature.id.size() + 1);
      fail_input("--features: {} '{}' is {}", feature.id, row, unknown_text(row, rows));
    }
  }
  fail_input("--features: '{}' is {}", name, unknown_text(name, known));
}

}  // namespace

std::vector<WantedFeature> parse_wanted_features(std::string_view text) {
  std::vector<WantedFeature> all;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    WantedFeature wanted = parse_wanted_feature(text.substr(begin, end - begin));
    begin = end + 1;
    const auto same = std::ranges::find(all, wanted.feature, &WantedFeature::feature);
    if (same == all.end()) {
      all.push_back(std::move(wanted));
      continue;
    }
    std::erase_if(same->rows, [&](const FeatureRow* row) { return std::ranges::count(wanted.rows, row) == 0; });
    if (same->rows.empty() && same->feature != nullptr)
      fail_input("--features {}: no row of {} is all of that", text, same->feature->id);
  }
  return all;
}

bool shows(const Settings& settings, std::span<const WantedFeature> wanted) {
  return std::ranges::all_of(wanted, [&](const WantedFeature& one) {
    if (one.feature == nullptr) return settings.technique().reads_map();
    const Param* const param = settings.technique().find(one.feature->id);
    if (param == nullptr) return false;
    const std::string_view row = settings.choice(param->id);
    return std::ranges::any_of(one.rows, [&](const FeatureRow* wanted_row) { return wanted_row->id == row; });
  });
}

}  // namespace reliefbench
