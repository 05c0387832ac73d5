#include "tuner/decide/effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <unordered_map>

#include "tuner/decide/choose.h"
#include "tuner/decide/pareto.h"
#include "tuner/results/budgets.h"

namespace reliefbench {
namespace {

/// Parameters that make an axis together.
constexpr std::array kLinkedAxis = {std::string_view("format"), std::string_view("encoding")};

struct AxisCase {
  const Record* record;
  std::vector<int> values;  ///< of the axis's parameters
};

/// Cases of one scene that differ along an axis only, by all that they share.
using Lines = std::unordered_map<std::string, std::vector<AxisCase>>;

bool depends_on(const Param& param, std::string_view axis) {
  return param.active_if.starts_with(axis) && param.active_if.substr(axis.size()).starts_with('=');
}

/// What two settings must share to be compared along an axis.
std::string rest_of(const Settings& settings, std::span<const std::string_view> axis) {
  std::string rest(settings.technique().id);
  for (const SettingValue& given : settings.values()) {
    const auto concerns = [&](std::string_view one) { return given.param.id == one || depends_on(given.param, one); };
    if (!std::ranges::any_of(axis, concerns)) rest += fmt::format("&{}={}", given.param.id, given.value);
  }
  return rest;
}

/// The effects of one axis on one device, as they are gathered.
struct Pairs {
  std::vector<double> times;
  std::vector<std::vector<double>> errors = std::vector<std::vector<double>>(metrics().size());

  void add(const Record& from, const Record& to) {
    times.push_back(to.frame_time->summary.median / from.frame_time->summary.median);
    for (std::size_t i = 0; i < metrics().size(); ++i) {
      const MetricRow& metric = metrics()[i];
      if (!metric.lower_is_better) continue;
      const std::optional<double> before = metric_value(from, metric.id);
      const std::optional<double> after = metric_value(to, metric.id);
      if (before && after) errors[i].push_back(std::max(*after, kLeastError) / std::max(*before, kLeastError));
    }
  }
};

/// In the order in which they are told.
struct PairsKey {
  std::string backend;
  std::string device;
  std::string axis;
  std::vector<int> from;
  std::vector<int> to;
  std::string from_text;  // techniques may give a parameter other choices
  std::string to_text;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the comparison with 0 inside for a pointer
  auto operator<=>(const PairsKey&) const = default;
};

/// Whether `to` is a step along the axis from `from`.
bool is_step(const Param& param, int from, int to) { return param.counts_steps() ? to == 2 * from : from < to; }

void gather(const Lines& lines, std::span<const Param* const> axis, std::map<PairsKey, Pairs>& all) {
  std::string name;
  for (const Param* param : axis) name += fmt::format("{}{}", name.empty() ? "" : ", ", param->id);
  const auto text_of = [&](const AxisCase& one) {
    std::string text;
    for (std::size_t i = 0; i < axis.size(); ++i)
      text += fmt::format("{}{}", text.empty() ? "" : " ", axis[i]->text(one.values[i]));
    return text;
  };
  for (const auto& [rest, cases] : lines)
    for (const AxisCase& from : cases)
      for (const AxisCase& to : cases) {
        // A linked axis is of those pairs that differ in all of its parameters; the first says which comes first.
        bool differs = is_step(*axis.front(), from.values.front(), to.values.front());
        for (std::size_t i = 1; i < axis.size(); ++i) differs = differs && from.values[i] != to.values[i];
        if (!differs) continue;
        const bool counts = axis.front()->counts_steps();
        const std::vector<int> none;
        const PairsKey key{.backend = from.record->backend,
                           .device = from.record->device,
                           .axis = name,
                           .from = counts ? none : from.values,
                           .to = counts ? none : to.values,
                           .from_text = counts ? "n" : text_of(from),
                           .to_text = counts ? "2n" : text_of(to)};
        all[key].add(*from.record, *to.record);
      }
}

/// The axes of a scene's settings: each parameter that some technique has, and the linked ones.
std::vector<std::vector<std::string_view>> axes_of(std::span<const std::pair<const Record*, Settings>> cases) {
  std::vector<std::vector<std::string_view>> axes;
  for (const auto& [record, settings] : cases)
    for (const SettingValue& given : settings.values())
      if (std::ranges::find(axes, std::vector{given.param.id}) == axes.end()) axes.push_back({given.param.id});
  axes.emplace_back(kLinkedAxis.begin(), kLinkedAxis.end());
  return axes;
}

void gather_group(const RecordGroup& group, std::map<PairsKey, Pairs>& all) {
  std::vector<std::pair<const Record*, Settings>> cases;
  for (const Record* record : group.records)
    if (record->status == Status::ok && record->frame_time && record->error)
      cases.emplace_back(record, settings_of(*record));
  for (const std::vector<std::string_view>& axis : axes_of(cases)) {
    // Techniques may have a parameter of one name with different choices: lines are within a technique.
    std::map<const Technique*, Lines> lines;
    for (const auto& measured : cases) {
      const Settings& settings = measured.second;
      const auto is_active = [&](std::string_view id) { return settings.active(id) != nullptr; };
      if (!std::ranges::all_of(axis, is_active)) continue;
      AxisCase one{.record = measured.first, .values = {}};
      for (const std::string_view id : axis) one.values.push_back(settings.get(id));
      lines[&settings.technique()][rest_of(settings, axis)].push_back(std::move(one));
    }
    for (const auto& [technique, own] : lines) {
      std::vector<const Param*> params;
      params.reserve(axis.size());
      for (const std::string_view id : axis) params.push_back(technique->find(id));
      gather(own, params, all);
    }
  }
}

bool prices_feature(const PairsKey& key) {
  return std::ranges::any_of(all_features(), [&](const Feature& feature) {
    return feature.is_of_scene && feature.id == key.axis && feature.rows.front().id == key.from_text;
  });
}

}  // namespace

std::vector<AxisEffect> axis_effects(std::span<const Record> records) {
  std::map<PairsKey, Pairs> all;
  for (const RecordGroup& group : group_records(records)) gather_group(group, all);
  std::vector<AxisEffect> effects;
  for (const auto& [key, pairs] : all) {
    AxisEffect effect{.backend = key.backend,
                      .device = key.device,
                      .axis = key.axis,
                      .from = key.from_text,
                      .to = key.to_text,
                      .prices_feature = prices_feature(key),
                      .pairs = pairs.times.size(),
                      .time = summarise(pairs.times)};
    for (const std::vector<double>& ratios : pairs.errors)
      effect.errors.push_back(ratios.empty() ? std::nullopt : std::optional(summarise(ratios)));
    effects.push_back(std::move(effect));
  }
  return effects;
}

}  // namespace reliefbench
