#include "kernels/trace/feature.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <iterator>

#include "kernels/judge/score.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"

namespace reliefbench {

std::vector<Param> params_of(const FeatureUse& use) {
  const auto feature = std::ranges::find(all_features(), use.feature, &Feature::id);
  assert(feature != all_features().end());
  std::vector<std::string_view> ids;
  for (const FeatureRow& row : feature->rows) ids.push_back(row.id);
  Param choice =
      choice_param(feature->id, feature->description, ids, use.fallback.empty() ? ids.front() : use.fallback);
  choice.active_if = use.active_if;
  choice.constant_id = feature->constant_id;
  choice.is_spelt_out = feature->is_spelt_out || use.is_spelt_out;
  assert(choice.is_spelt_out || choice.fallback == 0);
  std::vector<Param> params{std::move(choice)};
  for (std::size_t i = feature->rows.size(); i-- > 0;)
    for (Param param : feature->rows[i].params) {
      const auto same = std::ranges::find(params, param.id, &Param::id);
      if (same != params.end()) {
        same->active_if += fmt::format("|{}", feature->rows[i].id);
        continue;
      }
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

std::vector<PixelFeature> chosen_features(const Settings& settings) {
  std::vector<PixelFeature> features;
  for (const Feature& feature : all_features())
    if (settings.active(feature.id) != nullptr && settings.get(feature.id) != 0)
      features.push_back(
          {.feature = &feature, .row = &feature.rows.at(static_cast<std::size_t>(settings.get(feature.id)))});
  return features;
}

std::vector<PixelFeature> frame_features(const Settings& settings) {
  std::vector<PixelFeature> features = chosen_features(settings);
  std::erase_if(features, [](const PixelFeature& one) { return !one.feature->is_of_scene; });
  return features;
}

std::vector<PixelFeature> with_values(std::span<const PixelFeature> features) {
  std::vector<PixelFeature> valued;
  std::ranges::copy_if(features, std::back_inserter(valued),
                       [](const PixelFeature& one) { return one.feature->value.has_value(); });
  return valued;
}

std::vector<PixelFeature> pixel_features(const Settings& settings) { return with_values(frame_features(settings)); }

bool shows_in_objects(const Feature& feature) { return feature.value && feature.value->has_objects; }

std::vector<PixelFeature> exact_features() {
  std::vector<PixelFeature> features;
  for (const Feature& feature : all_features())
    if (feature.value && !shows_in_objects(feature)) features.push_back({.feature = &feature, .row = nullptr});
  return features;
}

bool has_value_of(const Settings& settings, Query query) {
  return std::ranges::any_of(pixel_features(settings),
                             [&](const PixelFeature& one) { return one.feature->value->query == query; });
}

std::string text_of(std::span<const PixelFeature> features) {
  std::string text;
  for (const auto& [feature, row] : features)
    text += fmt::format("{}{}={}", text.empty() ? "" : "&", feature->id, row == nullptr ? "exact" : row->id);
  return text;
}

std::vector<PixelFeature> exact_ones(std::span<const PixelFeature> features) {
  std::vector<PixelFeature> exact(features.begin(), features.end());
  for (PixelFeature& one : exact) one.row = nullptr;
  return exact;
}

FeatureValues exact_values(std::span<const PixelFeature> features, const ReferenceTracer& tracer,
                           const FrameUniforms& frame, std::span<const TextureRay> rays,
                           std::span<const ReferenceHit> hits) {
  FeatureValues values;
  for (const PixelFeature& one : features) values.push_back(one.feature->value->exact(tracer, frame, rays, hits));
  return values;
}

void judge_features(std::span<const PixelFeature> features, const FeatureValues& found, const FeatureValues& exact,
                    std::span<const PixelScore> mask, FrameScore& score) {
  for (std::size_t i = 0; i < features.size(); ++i)
    judge_feature(features[i].feature->id, found[i], exact[i], mask, score);
}

bool stands_on(Ground ground, const Surface& surface) {
  switch (ground) {
    case Ground::any:
      return true;
    case Ground::no_mesh:
      return surface.kind != SurfaceKind::mesh;
    case Ground::curved:
      return is_curved(surface.kind);
  }
  return false;
}

std::string lacking_in(std::span<const PixelFeature> features, const Scene& scene) {
  for (const auto& [feature, row] : features) {
    if (!stands_on(feature->ground, scene.surface))
      return fmt::format("{}={} needs a {}, not a {}", feature->id, row->id,
                         feature->ground == Ground::curved ? "curved surface" : "surface that is given by numbers",
                         surface_row(scene.surface.kind).id);
    if (row->lacks_in != nullptr)
      if (std::string what = row->lacks_in(scene); !what.empty()) return what;
  }
  return "";
}

std::string lacking(const std::vector<const FeatureRow*>& rows, const Settings& settings) {
  for (const FeatureRow* row : rows)
    if (row->lacks != nullptr)
      if (std::string what = row->lacks(settings); !what.empty()) return what;
  return "";
}

}  // namespace reliefbench
