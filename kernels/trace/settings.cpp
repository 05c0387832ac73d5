// Values for the parameters that a technique spans, and what follows from them.
#include <algorithm>
#include <array>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/technique.h"

namespace reliefbench {

Settings::Settings(const Technique& technique) : technique_(&technique) {
  for (const Param& param : technique.params) values_.push_back(param.fallback);
}

std::size_t Settings::place_of(std::string_view param_id) const {
  const Param* const param = technique_->find(param_id);
  if (param == nullptr) {
    std::vector<std::string_view> known;
    for (const Param& other : technique_->params) known.push_back(other.id);
    fail_input("technique '{}': parameter '{}' is {}", technique_->id, param_id, unknown_text(param_id, known));
  }
  return static_cast<std::size_t>(param - technique_->params.data());
}

void Settings::set(std::string_view param_id, int value) {
  const std::size_t place = place_of(param_id);
  technique_->params[place].check(value);
  values_[place] = value;
}

void Settings::set(std::string_view param_id, std::string_view text) {
  const std::size_t place = place_of(param_id);
  values_[place] = technique_->params[place].parse(text);
}

int Settings::get(std::string_view param_id) const {
  const std::size_t place = place_of(param_id);
  const Param& param = technique_->params[place];
  return is_active(param) ? values_[place] : param.fallback;
}

std::string_view Settings::choice(std::string_view param_id) const {
  const std::size_t place = place_of(param_id);
  return technique_->params[place].choices.at(static_cast<std::size_t>(get(param_id)));
}

bool Settings::is_active(const Param& param) const {
  if (param.active_if.empty()) return true;
  const std::string_view condition = param.active_if;
  const std::size_t split = condition.find('=');
  const Param* const other = active(condition.substr(0, split));
  if (other == nullptr) return false;
  const std::string_view chosen = choice(other->id);
  for (std::string_view rest = condition.substr(split + 1); !rest.empty();) {
    const std::size_t end = std::min(rest.find('|'), rest.size());
    if (rest.substr(0, end) == chosen) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

const Param* Settings::active(std::string_view param_id) const {
  const Param* const param = technique_->find(param_id);
  return param != nullptr && is_active(*param) ? param : nullptr;
}

bool Settings::is(std::string_view param_id, std::string_view choice_id) const {
  return active(param_id) != nullptr && choice(param_id) == choice_id;
}

std::vector<SettingValue> Settings::values() const {
  std::vector<SettingValue> list;
  for (std::size_t i = 0; i < values_.size(); ++i)
    if (is_active(technique_->params[i])) list.push_back({.param = technique_->params[i], .value = values_[i]});
  return list;
}

std::vector<SettingValue> Settings::written() const {
  std::vector<SettingValue> list;
  for (const SettingValue& given : values())
    if (given.is_written()) list.push_back(given);
  return list;
}

std::string Settings::text() const {
  std::string out;
  for (const SettingValue& given : written())
    out += fmt::format("{}{}={}", out.empty() ? "" : "&", given.param.id, given.text());
  return out;
}

const MapRow& map_of(const Settings& settings) {
  return settings.active("map") != nullptr ? find_map(settings.choice("map"))
                                           : find_map(settings.technique().maps.front());
}

std::vector<MapValue> map_values(const Settings& settings) {
  std::vector<MapValue> values;
  for (const MapParam& param : map_of(settings).parameters)
    values.push_back({.param = param.id, .value = settings.get(param.id)});
  return values;
}

MapStorage storage_of(const Settings& settings) {
  const auto choice_or = [&](std::string_view id, std::string_view otherwise) {
    return settings.active(id) != nullptr ? settings.choice(id) : otherwise;
  };
  return {.map = map_of(settings),
          .format = find_format(choice_or("format", formats().front().id)),
          .encoding = find_encoding(choice_or("encoding", "ratio")),
          .correction = find_correction(choice_or("correction", "none")),
          .max_ratio = settings.is("max_ratio", "unbounded") ? kUnboundedRatio : 1};
}

bool reads_levels(const Settings& settings) { return settings.active("lod") != nullptr && settings.get("lod") != 0; }

Mips mips_of(const Settings& settings) {
  if (!reads_levels(settings)) return Mips::none;
  return settings.technique().guarantee == Guarantee::none ? Mips::mean : Mips::conservative;
}

bool is_dithered(const Settings& settings) {
  const Param* const dither = settings.active("dither");
  return dither != nullptr && settings.get(dither->id) != dither->fallback;
}

bool is_by_compute(const Settings& settings) { return settings.is("dispatch", "compute"); }

int frames_seen(const Settings& settings) { return settings.is("dither", "temporal") ? kDitherFrames : 1; }

int step_cap(const Settings& settings) {
  int cap = is_dithered(settings) ? 1 : 0;
  for (const SettingValue& given : settings.values()) cap += given.param.counts_steps() ? given.value : 0;
  return cap;
}

Guarantee guarantee_of(const Settings& settings, Query query) {
  auto guarantee = query == Query::primary ? settings.technique().guarantee_when : nullptr;
  for (const auto& [feature, row] : frame_features(settings)) {
    if (feature->value && feature->value->query == query) guarantee = row->guarantee_when;
    if (!row->keeps_guarantee && query == Query::primary) return Guarantee::none;
  }
  return guarantee == nullptr ? Guarantee::none : guarantee(settings);
}

bool has_free_cones(const Settings& settings) {
  const MapStorage storage = storage_of(settings);
  if (storage.map.is_of_cells) return true;
  const bool is_safe = storage.correction == Correction::safe || storage.correction == Correction::certified ||
                       storage.correction == Correction::min4;
  // Devices may read heights of BC4 and BC5 up to a code lower than they are here, which no margin makes up for yet; of
  // EAC they may be 0.03 codes off, which ratios allow for, but hits do not. BC7 all read alike.
  if (is_of_blocks(storage.format.type) && storage.format.type != TexelType::bc7) return false;
  constexpr std::array kConservative{MapKind::conservative, MapKind::quick, MapKind::quick_naive, MapKind::quad,
                                     MapKind::sector};
  if (!is_safe || std::ranges::find(kConservative, storage.map.kind) == kConservative.end()) return false;
  // Where a sampler reads a sector's cone beside the ray, little is sure of the last 1/256 of the height: only solved
  // cells lead on from there, so that plain steps rather promise nothing.
  return storage.map.kind != MapKind::sector || !settings.is("filter", "hardware") || settings.is("step", "cell_quad");
}

bool makes_up_for_filter(const Settings& settings) {
  return settings.is("filter", "hardware") &&
         (guarantee_of(settings) != Guarantee::none || guarantee_of(settings, Query::shadow) != Guarantee::none);
}

std::string heights_conflict(const Settings& settings, bool is_solid) {
  const std::string_view technique = settings.technique().id;
  if (settings.technique().is_of_solids() && !is_solid)
    return fmt::format("{} is of solids: it needs a heightmap of two heights a texel", technique);
  const std::vector<PixelFeature> valued = pixel_features(settings);
  if (is_solid && !valued.empty())
    return fmt::format("{} of a solid, a heightmap of two heights a texel, is not traced", valued.front().feature->id);
  return "";
}

std::string conflict(const Settings& settings, const Scene& scene, bool is_solid) {
  if (std::string reason = conflict(settings); !reason.empty()) return reason;
  if (is_curved(scene.surface.kind) && !settings.technique().passes.empty())
    return fmt::format("{} draws planes: it needs a plane, not a {}", settings.technique().id,
                       surface_row(scene.surface.kind).id);
  if (is_curved(scene.surface.kind) && is_solid)
    return fmt::format("a solid, a heightmap of two heights a texel, needs a plane, not a {}",
                       surface_row(scene.surface.kind).id);
  if (std::string reason = heights_conflict(settings, is_solid); !reason.empty()) return reason;
  return lacking_in(chosen_features(settings), scene);
}

std::string conflict(const Settings& settings) {
  std::string reason = settings.technique().reads_map() ? conflict(storage_of(settings)) : "";
  if (const auto refusal = map_of(settings).refusal; reason.empty() && refusal != nullptr)
    reason = refusal(map_values(settings));
  return reason.empty() ? lacking(rows_of(settings), settings) : reason;
}

}  // namespace reliefbench
