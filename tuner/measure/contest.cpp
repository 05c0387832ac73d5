#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "tuner/measure/claims.h"
#include "tuner/plan/scene_key.h"
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

Duel duel_of(const SceneRows& rows, const std::string& of, const std::string& by) {
  return {.scene = rows.id(), .of = of, .by = by, .quotients = rows.quotients(of, by)};
}

std::string fastest_of(const SceneRows& rows, const Labels& labels) {
  return least_of(labels, [&](const std::string& label) { return rows.time_for_choosing(label); });
}

/// In a scene the fastest of those that are no worse; "" if none is.
std::string fastest_no_worse(const SceneRows& rows, const std::string& of, const std::string& metric,
                             const Labels& labels) {
  return fastest_of(rows, only(labels, [&](const std::string& label) { return rows.is_no_worse(label, of, metric); }));
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
    const auto is_within = [&](const std::string& label) {
      return check.at_most && rows.value(label, check.metric) <= *check.at_most;
    };
    for (const std::string& of : check.of_each) {
      Labels labels = check.beaten_by;
      labels.push_back(of);  // nothing is slower than itself
      duels.push_back(duel_of(rows, of, fastest_no_worse(rows, of, check.metric, labels)));
    }
    const std::string of = fastest_of(rows, only(check.best_of, is_within));
    const std::string by = fastest_of(rows, only(check.beaten_by, is_within));
    if (!of.empty() && !by.empty()) duels.push_back(duel_of(rows, of, by));
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

// Held against settings: what is tuned for each scene, and one setting for all.

/// One with the same settings is no other.
Labels others_than(const std::string& of, const Claim& claim, const Labels& labels) {
  const auto setting = [&](const std::string& label) {
    return setting_id(claim.rows[claim.row_index(label)].settings);
  };
  return only(labels, [&](const std::string& label) { return setting(label) != setting(of); });
}

/// The fastest over all scenes of those that are no worse in any; "" if none is.
std::string fastest_for_all(std::span<const SceneRows> scenes, const std::string& of, const std::string& metric,
                            const Labels& labels) {
  const auto is_no_worse = [&](const std::string& label) {
    return std::ranges::all_of(scenes, [&](const SceneRows& rows) { return rows.is_no_worse(label, of, metric); });
  };
  const auto time = [&](const std::string& label) {
    double logarithms = 0;
    for (const SceneRows& rows : scenes) logarithms += std::log(rows.time_for_choosing(label));
    return logarithms;
  };
  return least_of(only(labels, is_no_worse), time);
}

/// "e_xy.p99 0.52 to 3.1, 0.0100 missed at most"
std::string errors_text(const ClaimCheck& check, std::span<const SceneRows> scenes, const std::string& label) {
  std::vector<double> errors;
  errors.reserve(scenes.size());
  double missed = 0;
  for (const SceneRows& rows : scenes) {
    errors.push_back(rows.value(label, check.metric));
    missed = std::max(missed, rows.value(label, "missed_rate"));
  }
  const auto [least, greatest] = std::ranges::minmax(errors);
  return fmt::format("{} {:.3g} to {:.3g}, {:.4f} missed at most", check.metric, least, greatest, missed);
}

/// "'cone maps: 8' in 4, itself in 2"
std::string winners_text(std::span<const Duel> duels) {
  std::map<std::string, int> scenes_of;
  for (const Duel& duel : duels) ++scenes_of[duel.by == duel.of ? "itself" : fmt::format("'{}'", duel.by)];
  std::vector<std::string> parts;
  parts.reserve(scenes_of.size());
  for (const auto& [winner, count] : scenes_of) parts.push_back(fmt::format("{} in {}", winner, count));
  return fmt::format("{}", fmt::join(parts, ", "));
}

ClaimAnswer judge_one(const Claim& claim, const ClaimCheck& check, std::span<const SceneRows> scenes) {
  const Labels others = others_than(check.of, claim, check.beaten_by);
  Labels with_own = others;
  with_own.push_back(check.of);  // nothing is slower than itself
  std::vector<Duel> duels;
  duels.reserve(scenes.size());
  for (const SceneRows& rows : scenes)
    duels.push_back(duel_of(rows, check.of, fastest_no_worse(rows, check.of, check.metric, with_own)));
  const Summary mean = mean_of(duels);
  const std::string_view outcome = mean.ci_low > 1 ? "is beaten" : mean.ci_high <= 1 ? "is not beaten" : "is level";
  std::string one = fmt::format("none of {} others is as accurate in all of them", others.size());
  if (const std::string by = fastest_for_all(scenes, check.of, check.metric, others); !by.empty()) {
    std::vector<Duel> of_one;
    of_one.reserve(scenes.size());
    for (const SceneRows& rows : scenes) of_one.push_back(duel_of(rows, check.of, by));
    one = fmt::format("'{}' ({}), {} times", by, errors_text(check, scenes, by), interval_text(mean_of(of_one)));
  }
  return {.verdict = mean.ci_low > 1 ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced,
          .numbers = fmt::format("{} ({}, in {} scene{}) {}: the fastest in each scene that is no less accurate there "
                                 "is {} times as fast ({}); one setting for all of them: {}.",
                                 check.of, errors_text(check, scenes, check.of), scenes.size(),
                                 scenes.size() == 1 ? "" : "s", outcome, interval_text(mean), winners_text(duels), one),
          .duels = told(duels)};
}

/// "cone maps" of "cone maps: 8 steps"
std::string group_of(const Labels& labels) { return labels.front().substr(0, labels.front().find(':')); }

std::string cell_of(std::span<const Duel> duels) { return duels.empty() ? "-" : times_text(mean_of(duels)); }

/// "oblique 1.20 [1.11, 1.25], grazing 0.80 [0.75, 0.81]"
std::string by_view(std::span<const Duel> duels) {
  std::map<std::string, std::vector<Duel>> views;
  for (const Duel& duel : duels) views[std::string(view_part(duel.scene))].push_back(duel);
  std::vector<std::string> parts;
  parts.reserve(views.size());
  for (const auto& [view, of_view] : views) parts.push_back(fmt::format("{} {}", view, cell_of(of_view)));
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// How two groups of settings came out.
struct Tally {
  int ours = 0;
  int theirs = 0;
  int neither = 0;
  std::vector<Duel> by_ours{};    ///< of what they are held against
  std::vector<Duel> by_theirs{};  ///< likewise
  std::vector<Duel> between{};    ///< of theirs by ours, where both are as accurate
};

void count_scene(const SceneRows& rows, const std::string& of, const std::string& one, const std::string& other,
                 Tally& tally) {
  if (!one.empty()) tally.by_ours.push_back(duel_of(rows, of, one));
  if (!other.empty()) tally.by_theirs.push_back(duel_of(rows, of, other));
  if (!one.empty() && !other.empty()) tally.between.push_back(duel_of(rows, other, one));
  Labels labels{of};
  for (const std::string& label : {one, other})
    if (!label.empty()) labels.push_back(label);
  const std::string fastest = fastest_of(rows, labels);
  ++(fastest == of ? tally.neither : fastest == one ? tally.ours : tally.theirs);
}

ClaimAnswer judge_groups(const Claim& claim, const ClaimCheck& check, std::span<const SceneRows> scenes) {
  const std::string ours = group_of(check.beaten_by);
  const std::string theirs = group_of(check.rather_than);
  ClaimAnswer answer;
  answer.table = {{"times as fast as", ours, theirs, "the one as the other", "fastest in: these, itself"}};
  Tally all;
  for (const std::string& of : check.of_each) {
    Tally own;
    for (const SceneRows& rows : scenes) {
      const auto fastest = [&](const Labels& labels) {
        return fastest_no_worse(rows, of, check.metric, others_than(of, claim, labels));
      };
      count_scene(rows, of, fastest(check.beaten_by), fastest(check.rather_than), own);
    }
    answer.table.push_back({of, cell_of(own.by_ours), cell_of(own.by_theirs), cell_of(own.between),
                            fmt::format("{}, {}, {}", own.ours, own.theirs, own.neither)});
    all.ours += own.ours;
    all.theirs += own.theirs;
    all.neither += own.neither;
    all.between.insert(all.between.end(), own.between.begin(), own.between.end());
  }
  answer.numbers = fmt::format(
      "The fastest that is no less accurate, of {} in {} scene{}: {} {} times, {} {} times, "
      "itself {} times.",
      check.of_each.size(), scenes.size(), scenes.size() == 1 ? "" : "s", ours, all.ours, theirs, all.theirs,
      all.neither);
  if (all.between.empty()) return answer;
  answer.duels = told(all.between);
  const Summary mean = mean_of(all.between);
  const std::string_view outcome = mean.ci_low > 1 ? "win" : mean.ci_high < 1 ? "lose" : "neither win nor lose";
  answer.verdict = mean.ci_low > 1 ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced;
  answer.numbers += fmt::format(
      " Where both are as accurate, {} are {} times as fast as {}, geometric mean of {} ({}): "
      "{} {}.",
      ours, interval_text(mean), theirs, all.between.size(), by_view(all.between), ours, outcome);
  return answer;
}

}  // namespace

std::string times_text(const Summary& times_as_fast) {
  return fmt::format("{:.2f} [{:.2f}, {:.2f}]", times_as_fast.median, times_as_fast.ci_low, times_as_fast.ci_high);
}

ClaimAnswer judge_contest(const Claim& claim, const ClaimCheck& check, std::span<const SceneFigures> scenes) {
  const std::vector<SceneRows> rows = rows_of(claim, scenes);
  if (check.by_factor > 0) return judge_factor(check, rows);
  return check.rather_than.empty() ? judge_one(claim, check, rows) : judge_groups(claim, check, rows);
}

}  // namespace reliefbench
