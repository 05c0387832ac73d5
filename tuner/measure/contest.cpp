#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "tuner/measure/claims.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

using Labels = std::vector<std::string>;

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

  [[nodiscard]] const std::string& id() const { return scene_.scene->id; }
  [[nodiscard]] const ClaimFigures& operator[](const std::string& label) const {
    return scene_.rows[claim_.row_index(label)];
  }
  /// Infinite where it has none.
  [[nodiscard]] double value(const std::string& label, const std::string& metric) const {
    const auto& values = (*this)[label].values;
    const auto found = values.find(metric);
    return found == values.end() ? std::numeric_limits<double>::infinity() : found->second;
  }
  /// Whether a setting has no more of the metric than another, nor more misses.
  [[nodiscard]] bool is_no_worse(const std::string& label, const std::string& than, const std::string& metric) const {
    return value(label, metric) <= value(than, metric) && value(label, "missed_rate") <= value(than, "missed_rate");
  }
  [[nodiscard]] double time_for_choosing(const std::string& label) const {
    return median(half_of((*this)[label].times_ns, true));
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

std::vector<SceneRows> rows_of(const Claim& claim, std::span<const SceneFigures> scenes) {
  std::vector<SceneRows> list;
  list.reserve(scenes.size());
  for (const SceneFigures& scene : scenes) list.emplace_back(claim, scene);
  return list;
}

/// Of some labels the one with the least of something; "" if there are none.
template <typename Value>
std::string least_of(const Labels& labels, const Value& value) {
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::string& label : labels) {
    const double own = value(label);
    if (own >= least) continue;
    least = own;
    best = label;
  }
  return best;
}

template <typename Admits>
Labels only(const Labels& labels, const Admits& admits) {
  Labels list;
  std::ranges::copy_if(labels, std::back_inserter(list), admits);
  return list;
}

/// The setting that is beaten in a scene, and by how much.
struct Duel {
  std::string scene;
  std::string of;
  std::string by;
  std::vector<double> quotients;  ///< one a round
};

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

Summary mean_of(std::span<const Duel> duels) {
  return summarise(means(duels, [](const Duel&) { return true; }));
}

/// "1.25 [1.20, 1.31; 93.8 %]"
std::string interval_text(const Summary& ratio) {
  return fmt::format("{:.2f} [{:.2f}, {:.2f}; {}]", ratio.median, ratio.ci_low, ratio.ci_high, coverage_text(ratio.n));
}

std::vector<ClaimDuel> told(std::span<const Duel> duels) {
  std::vector<ClaimDuel> list;
  list.reserve(duels.size());
  for (const Duel& duel : duels)
    list.push_back({.scene = duel.scene, .of = duel.of, .by = duel.by, .times_as_fast = summarise(duel.quotients)});
  return list;
}

// In each scene its own fastest setting.

std::vector<Duel> duels_of(const ClaimCheck& check, std::span<const SceneRows> scenes) {
  std::vector<Duel> duels;
  for (const SceneRows& rows : scenes) {
    const auto fastest = [&](const Labels& labels) {
      return least_of(labels, [&](const std::string& label) { return rows.time_for_choosing(label); });
    };
    const auto add = [&](const std::string& of, const std::string& by) {
      duels.push_back({.scene = rows.id(), .of = of, .by = by, .quotients = rows.quotients(of, by)});
    };
    const auto is_within = [&](const std::string& label) {
      return check.at_most && rows.value(label, check.metric) <= *check.at_most;
    };
    for (const std::string& of : check.of_each) {
      Labels labels =
          only(check.beaten_by, [&](const std::string& label) { return rows.is_no_worse(label, of, check.metric); });
      labels.push_back(of);  // nothing is slower than itself
      add(of, fastest(labels));
    }
    const std::string of = fastest(only(check.best_of, is_within));
    const std::string by = fastest(only(check.beaten_by, is_within));
    if (!of.empty() && !by.empty()) add(of, by);
  }
  return duels;
}

std::string map_of_scene(const std::string& scene) { return scene.substr(0, scene.find('/')); }

/// A line a setting, a column a map, over its views.
std::vector<std::vector<std::string>> table_by_map(const ClaimCheck& check, std::span<const Duel> duels) {
  std::vector<std::string> maps;
  for (const Duel& duel : duels)
    if (std::ranges::find(maps, map_of_scene(duel.scene)) == maps.end()) maps.push_back(map_of_scene(duel.scene));
  std::vector<std::vector<std::string>> table{{"times as fast"}};
  table[0].insert(table[0].end(), maps.begin(), maps.end());
  table[0].emplace_back("all");
  const auto cell = [&](const auto& admits) { return fmt::format("{:.2f}", median(means(duels, admits))); };
  for (const std::string& of : check.of_each) {
    std::vector<std::string> line{of};
    for (const std::string& map : maps)
      line.push_back(cell([&](const Duel& duel) { return duel.of == of && map_of_scene(duel.scene) == map; }));
    line.push_back(cell([&](const Duel& duel) { return duel.of == of; }));
    table.push_back(std::move(line));
  }
  return table;
}

ClaimAnswer judge_factor(const ClaimCheck& check, std::span<const SceneRows> scenes) {
  const std::vector<Duel> duels = duels_of(check, scenes);
  if (duels.empty())
    return {.verdict = ClaimVerdict::not_testable,
            .numbers = fmt::format("no setting has {} of at most {}", check.metric, check.at_most.value_or(0))};
  const Summary mean = mean_of(duels);
  const bool is_reached = mean.ci_low >= check.by_factor;
  std::vector<double> all;
  all.reserve(duels.size());
  for (const Duel& duel : duels) all.push_back(median(duel.quotients));
  const auto [least, greatest] = std::ranges::minmax(all);
  ClaimAnswer answer{.verdict = is_reached ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced,
                     .numbers = fmt::format("{} times as fast, geometric mean of {} over {} scenes, each {:.2f} to "
                                            "{:.2f}; {:g} was asked: {}",
                                            interval_text(mean), duels.size(), scenes.size(), least, greatest,
                                            check.by_factor, is_reached ? "reached" : "not reached"),
                     .duels = told(duels)};
  if (!check.of_each.empty()) answer.table = table_by_map(check, duels);
  return answer;
}

// One setting for all scenes.

/// A setting that is held against another one, and the duels between them.
struct Rival {
  std::string label;  ///< "": there is none
  std::vector<Duel> duels{};
  Summary ratio{};  ///< the mean over all scenes

  [[nodiscard]] bool is_faster() const { return !label.empty() && ratio.ci_low > 1; }
};

Rival duelling(std::span<const SceneRows> scenes, const std::string& of, const std::string& by) {
  Rival rival{.label = by};
  if (by.empty()) return rival;
  rival.duels.reserve(scenes.size());
  for (const SceneRows& rows : scenes)
    rival.duels.push_back({.scene = rows.id(), .of = of, .by = by, .quotients = rows.quotients(of, by)});
  rival.ratio = mean_of(rival.duels);
  return rival;
}

/// The fastest of those that are no worse in any scene.
Rival rival_of(const ClaimCheck& check, std::span<const SceneRows> scenes, const std::string& of,
               const Labels& labels) {
  const auto is_no_worse = [&](const std::string& label) {
    return std::ranges::all_of(scenes,
                               [&](const SceneRows& rows) { return rows.is_no_worse(label, of, check.metric); });
  };
  const auto time = [&](const std::string& label) {
    double logarithms = 0;
    for (const SceneRows& rows : scenes) logarithms += std::log(rows.time_for_choosing(label));
    return logarithms;
  };
  return duelling(scenes, of, least_of(only(labels, is_no_worse), time));
}

/// One with the same settings is no other.
Labels others_than(const std::string& of, const Claim& claim, const Labels& labels) {
  const auto setting = [&](const std::string& label) {
    return setting_id(claim.rows[claim.row_index(label)].settings);
  };
  return only(labels, [&](const std::string& label) { return setting(label) != setting(of); });
}

/// "e_xy.p99 0.52 to 3.1, 0.0100 missed at most"
std::string errors_text(const ClaimCheck& check, std::span<const SceneRows> scenes, const std::string& label) {
  std::vector<double> errors;
  double missed = 0;
  for (const SceneRows& rows : scenes) {
    errors.push_back(rows.value(label, check.metric));
    missed = std::max(missed, rows.value(label, "missed_rate"));
  }
  const auto [least, greatest] = std::ranges::minmax(errors);
  return fmt::format("{} {:.3g} to {:.3g}, {:.4f} missed at most", check.metric, least, greatest, missed);
}

ClaimAnswer judge_one(const Claim& claim, const ClaimCheck& check, std::span<const SceneRows> scenes) {
  const Labels others = others_than(check.of, claim, check.beaten_by);
  const Rival rival = rival_of(check, scenes, check.of, others);
  const std::string own = fmt::format("{} ({}, in {} scene{})", check.of, errors_text(check, scenes, check.of),
                                      scenes.size(), scenes.size() == 1 ? "" : "s");
  if (rival.label.empty())
    return {.verdict = ClaimVerdict::not_reproduced,
            .numbers = fmt::format("{} is not beaten: none of {} others is no less accurate in every scene.", own,
                                   others.size())};
  const std::string_view outcome = rival.is_faster()         ? "is beaten by"
                                   : rival.ratio.ci_high < 1 ? "is not beaten by"
                                                             : "is not known to be beaten by";
  return {.verdict = rival.is_faster() ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced,
          .numbers = fmt::format("{} {} '{}' ({}), the fastest that is no less accurate in any of them: {} times as "
                                 "fast.",
                                 own, outcome, rival.label, errors_text(check, scenes, rival.label),
                                 interval_text(rival.ratio)),
          .duels = told(rival.duels)};
}

/// "cone maps" of "cone maps: 8 steps"
std::string group_of(const Labels& labels) { return labels.front().substr(0, labels.front().find(':')); }

std::string cell_of(const Rival& rival) {
  if (rival.label.empty()) return "-";
  return fmt::format("{:.2f} [{:.2f}, {:.2f}]", rival.ratio.median, rival.ratio.ci_low, rival.ratio.ci_high);
}

/// "2 of 12 (Godot; Unreal)"
std::string count_text(const Labels& labels, std::size_t of) {
  if (labels.empty()) return fmt::format("none of {}", of);
  return fmt::format("{} of {} ({})", labels.size(), of, fmt::join(labels, "; "));
}

ClaimAnswer judge_groups(const Claim& claim, const ClaimCheck& check, std::span<const SceneRows> scenes) {
  const std::string ours = group_of(check.beaten_by);
  const std::string theirs = group_of(check.rather_than);
  ClaimAnswer answer;
  answer.table = {{"against", ours, "times as fast", theirs, "times as fast", "the one as the other"}};
  std::vector<Duel> duels;
  Labels by_ours;
  Labels by_theirs;
  Labels by_either;
  Labels by_none;
  for (const std::string& of : check.of_each) {
    const Rival one = rival_of(check, scenes, of, others_than(of, claim, check.beaten_by));
    const Rival other = rival_of(check, scenes, of, others_than(of, claim, check.rather_than));
    Rival both;
    if (!one.label.empty() && !other.label.empty()) both = duelling(scenes, other.label, one.label);
    answer.table.push_back({of, one.label, cell_of(one), other.label, cell_of(other), cell_of(both)});
    duels.insert(duels.end(), both.duels.begin(), both.duels.end());
    const bool is_ours = one.is_faster() && (!other.is_faster() || both.ratio.ci_low > 1);
    const bool is_theirs = other.is_faster() && (!one.is_faster() || both.ratio.ci_high < 1);
    (is_ours ? by_ours : is_theirs ? by_theirs : one.is_faster() ? by_either : by_none).push_back(of);
  }
  const std::size_t count = check.of_each.size();
  answer.numbers = fmt::format(
      "Fastest, no less accurate in any of {} scenes and faster than what it is held against: {} for {}, {} for {}, "
      "either for {}, neither for {}.",
      scenes.size(), ours, count_text(by_ours, count), theirs, count_text(by_theirs, count),
      count_text(by_either, count), count_text(by_none, count));
  answer.duels = told(duels);
  if (duels.empty()) return answer;
  const Summary mean = mean_of(duels);
  const std::string_view outcome = mean.ci_low > 1 ? "win" : mean.ci_high < 1 ? "lose" : "neither win nor lose";
  answer.verdict = mean.ci_low > 1 ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced;
  answer.numbers +=
      fmt::format(" Where both are as accurate, {} are {} times as fast as {}, geometric mean over {}: {} {}.", ours,
                  interval_text(mean), theirs, duels.size() / scenes.size(), ours, outcome);
  return answer;
}

}  // namespace

ClaimAnswer judge_contest(const Claim& claim, const ClaimCheck& check, std::span<const SceneFigures> scenes) {
  const std::vector<SceneRows> rows = rows_of(claim, scenes);
  if (check.by_factor > 0) return judge_factor(check, rows);
  return check.rather_than.empty() ? judge_one(claim, check, rows) : judge_groups(claim, check, rows);
}

}  // namespace reliefbench
