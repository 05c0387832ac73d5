#include "tuner/measure/require_space.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

/// One row of a feature, with the bits that it sets.
struct Option {
  const FeatureRow* row = nullptr;
  FeatureSet set = 0;
};
/// A feature with the rows that stand for what it may bring; the plainest is not among them.
struct FeatureAxis {
  const Feature* feature = nullptr;
  std::vector<Option> options{};
};

bool is_allowed(const SceneFile& file, const Feature& feature, const FeatureRow& row) {
  const auto rows = file.rows.find(feature.id);
  return rows == file.rows.end() || std::ranges::find(rows->second, row.id) != rows->second.end();
}

/// The settings with one row; none where it makes no sense with them, or in one of the views.
std::optional<Settings> with_row(const SceneFile& file, Settings settings, const Feature& feature,
                                 const FeatureRow& row) {
  if (settings.technique().find(feature.id) == nullptr) return std::nullopt;
  settings.set(feature.id, row.id);
  for (const SceneSpec& spec : file.scenes)
    if (!conflict(settings, spec.scene, is_solid(spec.heightmap)).empty()) return std::nullopt;
  return settings;
}

class SpaceMaker {
 public:
  SpaceMaker(const SceneFile& file, const std::function<double(const Settings&)>& value, std::vector<TriedRow>& tried)
      : file_(file), value_(value), tried_(tried) {}

  SettingSpace make() {
    add_name(std::string(kDisplacement), std::string(file_.setting.technique().id));
    for (const Feature& feature : all_features())
      if (feature.is_of_scene && !shows_in_objects(feature)) add_axis(feature);
    add_sets(flat(), 0, 0);
    add_sets(file_.setting, 1, 0);
    return std::move(made_);
  }

 private:
  FeatureSet add_name(std::string name, std::string choice) {
    constexpr std::size_t kMost = 32;
    if (made_.space.features.size() == kMost) fail_input("{}: more than {} features", file_.path.string(), kMost);
    made_.space.features.push_back(std::move(name));
    made_.choices.push_back(std::move(choice));
    return FeatureSet{1} << (made_.space.features.size() - 1);
  }

  /// No displacement, dispatched as the setting is: what that costs is no price of displacement.
  [[nodiscard]] Settings flat() const {
    Settings settings(find_technique("flat"));
    settings.set("dispatch", file_.setting.get("dispatch"));
    return settings;
  }

  /// The feature itself by its best row without anything else, and by its best rows with each thing else.
  void add_axis(const Feature& feature) {
    std::vector<std::string_view> brought;
    for (const FeatureRow& row : feature.rows)
      if (&row != &feature.rows.front() && std::ranges::find(brought, row.also) == brought.end())
        brought.push_back(row.also);
    FeatureAxis axis{.feature = &feature};
    FeatureSet own = 0;
    for (const std::string_view also : brought) {
      const FeatureRow* const row = best_row(feature, also);
      if (row == nullptr) continue;
      const std::string choice = fmt::format("{}={}", feature.id, row->id);
      if (own == 0) own = add_name(std::string(feature.id), choice);
      axis.options.push_back({.row = row, .set = also.empty() ? own : own | add_name(std::string(also), choice)});
    }
    if (own != 0) axes_.push_back(std::move(axis));
  }

  const FeatureRow* best_row(const Feature& feature, std::string_view also) {
    const FeatureRow* best = nullptr;
    std::size_t best_place = 0;
    for (const FeatureRow& row : feature.rows) {
      if (&row == &feature.rows.front() || row.also != also || !is_allowed(file_, feature, row)) continue;
      const std::optional<Settings> settings = with_row(file_, file_.setting, feature, row);
      if (!settings) continue;
      tried_.push_back({.feature = std::string(also.empty() ? feature.id : also),
                        .choice = fmt::format("{}={}", feature.id, row.id),
                        .value = value_(*settings)});
      if (best == nullptr || tried_.back().value < tried_[best_place].value) {
        best = &row;
        best_place = tried_.size() - 1;
      }
    }
    if (best != nullptr) tried_[best_place].is_chosen = true;
    return best;
  }

  /// All sets over one from an axis on.
  void add_sets(const Settings& settings, FeatureSet set, std::size_t axis) {
    if (axis == axes_.size()) {
      made_.space.sets.push_back(set);
      made_.settings.emplace_back(set, settings);
      return;
    }
    add_sets(settings, set, axis + 1);
    for (const Option& option : axes_[axis].options)
      if (const std::optional<Settings> more = with_row(file_, settings, *axes_[axis].feature, *option.row))
        add_sets(*more, set | option.set, axis + 1);
  }

  const SceneFile& file_;
  const std::function<double(const Settings&)>& value_;
  std::vector<TriedRow>& tried_;
  std::vector<FeatureAxis> axes_;
  SettingSpace made_;
};

}  // namespace

const Settings& SettingSpace::at(FeatureSet set) const {
  return std::ranges::find(settings, set, &std::pair<FeatureSet, Settings>::first)->second;
}

SettingSpace setting_space(const SceneFile& file, const std::function<double(const Settings&)>& value,
                           std::vector<TriedRow>& tried) {
  return SpaceMaker(file, value, tried).make();
}

}  // namespace reliefbench
