#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tuner/measure/claims.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// Every second of a row's times: from the first on, for choosing; from the second on, for what is told of the chosen.
std::vector<double> half_of(const std::vector<double>& times, bool for_choosing) {
  std::vector<double> half;
  half.reserve(times.size() / 2 + 1);
  for (std::size_t i = for_choosing ? 0 : 1; i < times.size(); i += 2) half.push_back(times[i]);
  return half;
}

class SceneRows {
 public:
  SceneRows(const Claim& claim, const SceneFigures& scene) : claim_(claim), scene_(scene) {}

  [[nodiscard]] const ClaimFigures& operator[](const std::string& label) const {
    return scene_.rows[claim_.row_index(label)];
  }
  /// Infinite where it has none.
  [[nodiscard]] double value(const std::string& label, const std::string& metric) const {
    const auto& values = (*this)[label].values;
    const auto found = values.find(metric);
    return found == values.end() ? std::numeric_limits<double>::infinity() : found->second;
  }
  /// The fastest of those that are let in, by the times for choosing; "" if none is.
  template <typename Admits>
  [[nodiscard]] std::string fastest(const std::vector<std::string>& labels, const Admits& admits) const {
    std::string best;
    double least_ns = std::numeric_limits<double>::infinity();
    for (const std::string& label : labels) {
      if (!admits(label)) continue;
      const double own_ns = median(half_of((*this)[label].times_ns, true));
      if (own_ns < least_ns) {
        least_ns = own_ns;
        best = label;
      }
    }
    return best;
  }
  /// How much faster, round by round.
  [[nodiscard]] std::vector<double> quotients(const std::string& of, const std::string& by) const {
    std::vector<double> result = half_of((*this)[of].times_ns, false);
    const std::vector<double> less = half_of((*this)[by].times_ns, false);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] /= less[i];
    return result;
  }

 private:
  const Claim& claim_;
  const SceneFigures& scene_;
};

/// The setting that is beaten, and by how much.
struct Duel {
  const SceneFigures* scene;
  std::string of;
  std::string by;
  std::vector<double> quotients;  ///< one a round
};

std::vector<Duel> duels_of(const Claim& claim, const ClaimCheck& check, std::span<const SceneFigures> scenes) {
  std::vector<Duel> duels;
  for (const SceneFigures& scene : scenes) {
    const SceneRows rows(claim, scene);
    const auto add = [&](const std::string& of, const std::string& by) {
      duels.push_back({.scene = &scene, .of = of, .by = by, .quotients = rows.quotients(of, by)});
    };
    const auto is_within = [&](const std::string& label) {
      return check.at_most && rows.value(label, check.metric) <= *check.at_most;
    };
    for (const std::string& of : check.of_each) {
      const auto is_no_worse = [&](const std::string& label) {
        return rows.value(label, check.metric) <= rows.value(of, check.metric) &&
               rows.value(label, "missed_rate") <= rows.value(of, "missed_rate");
      };
      std::vector<std::string> labels = check.beaten_by;
      labels.push_back(of);  // nothing is slower than itself
      add(of, rows.fastest(labels, is_no_worse));
    }
    if (check.best_of.empty()) continue;
    const std::string of = rows.fastest(check.best_of, is_within);
    const std::string by = rows.fastest(check.beaten_by, is_within);
    if (!of.empty() && !by.empty()) add(of, by);
  }
  return duels;
}

/// Of the duels that are let in, the geometric mean of each round.
template <typename Admits>
std::vector<double> means(std::span<const Duel> duels, const Admits& admits) {
  std::vector<double> logarithms;
  int count = 0;
  for (const Duel& duel : duels) {
    if (!admits(duel)) continue;
    ++count;
    logarithms.resize(duel.quotients.size());
    for (std::size_t i = 0; i < logarithms.size(); ++i) logarithms[i] += std::log(duel.quotients[i]);
  }
  for (double& value : logarithms) value = std::exp(value / count);
  return logarithms;
}

std::string map_of_scene(const SceneFigures& scene) { return scene.scene->id.substr(0, scene.scene->id.find('/')); }

/// A line a setting, a column a map, over its views.
std::vector<std::vector<std::string>> table_by_map(const ClaimCheck& check, std::span<const Duel> duels) {
  std::vector<std::string> maps;
  for (const Duel& duel : duels)
    if (std::ranges::find(maps, map_of_scene(*duel.scene)) == maps.end()) maps.push_back(map_of_scene(*duel.scene));
  std::vector<std::vector<std::string>> table{{"times as fast"}};
  table[0].insert(table[0].end(), maps.begin(), maps.end());
  table[0].emplace_back("all");
  const auto cell = [&](const auto& admits) { return fmt::format("{:.2f}", median(means(duels, admits))); };
  for (const std::string& of : check.of_each) {
    std::vector<std::string> line{of};
    for (const std::string& map : maps)
      line.push_back(cell([&](const Duel& duel) { return duel.of == of && map_of_scene(*duel.scene) == map; }));
    line.push_back(cell([&](const Duel& duel) { return duel.of == of; }));
    table.push_back(std::move(line));
  }
  return table;
}

/// A line a scene.
std::vector<std::vector<std::string>> table_by_scene(std::span<const Duel> duels) {
  std::vector<std::vector<std::string>> table{{"scene", "fastest before", "fastest now", "times as fast"}};
  for (const Duel& duel : duels)
    table.push_back({duel.scene->scene->id, duel.of, duel.by, fmt::format("{:.2f}", median(duel.quotients))});
  return table;
}

}  // namespace

ClaimAnswer judge_contest(const Claim& claim, const ClaimCheck& check, std::span<const SceneFigures> scenes) {
  const std::vector<Duel> duels = duels_of(claim, check, scenes);
  if (duels.empty())
    return {.verdict = ClaimVerdict::not_testable,
            .numbers = fmt::format("no setting has {} of at most {}", check.metric, check.at_most.value_or(0))};
  const Summary mean = summarise(means(duels, [](const Duel&) { return true; }));
  const bool is_reached = mean.ci_low >= check.by_factor;
  std::vector<double> all;
  all.reserve(duels.size());
  for (const Duel& duel : duels) all.push_back(median(duel.quotients));
  const auto [least, greatest] = std::ranges::minmax(all);
  return {
      .verdict = is_reached ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced,
      .numbers = fmt::format("{:.2f} [{:.2f}, {:.2f}; {}] times as fast, geometric mean of {} over {} scenes, each "
                             "{:.2f} to {:.2f}; {:g} was asked: {}",
                             mean.median, mean.ci_low, mean.ci_high, coverage_text(mean.n), duels.size(), scenes.size(),
                             least, greatest, check.by_factor, is_reached ? "reached" : "not reached"),
      .table = check.best_of.empty() ? table_by_map(check, duels) : table_by_scene(duels)};
}

}  // namespace reliefbench
