#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "tuner/measure/claims.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

bool is_time(std::string_view metric) { return metric == "frame_time" || metric == "bake_time"; }

std::optional<double> value_of(const ClaimFigures& figures, std::string_view metric) {
  const auto found = figures.values.find(std::string(metric));
  return found == figures.values.end() ? std::nullopt : std::optional(found->second);
}

/// What a check compares in a scene, of several: "24.1 against 22.7, 1.06x".
std::string compared(const Claim& claim, const ClaimCheck& check, const SceneFigures& scene) {
  const auto value = [&](const std::string& label) {
    return value_of(scene.rows[claim.row_index(label)], check.metric);
  };
  const std::optional<double> of = value(check.of);
  if (!of) return "-";
  const std::string& label = check.than.empty() ? check.to : check.than;
  if (label.empty()) return fmt::format("{:.4g}", *of);
  const std::optional<double> other = value(label);
  return other ? fmt::format("{:.4g} against {:.4g}, {:.2f}x", *of, *other, *of / *other) : "-";
}

/// A line a map, a column a view.
std::vector<std::vector<std::string>> table_of_scenes(const Claim& claim, const ClaimCheck& check,
                                                      std::span<const SceneFigures> scenes) {
  std::vector<std::string> head{check.metric};
  std::vector<std::vector<std::string>> table;
  for (const SceneFigures& scene : scenes) {
    const std::string map(heightmap_part(scene.scene->id));
    const std::string view(view_part(scene.scene->id));
    auto column = std::ranges::find(head, view);
    if (column == head.end()) column = head.insert(head.end(), view);
    const auto place = static_cast<std::size_t>(column - head.begin());
    auto line = std::ranges::find(table, map, [](const auto& cells) { return cells.front(); });
    if (line == table.end()) line = table.insert(table.end(), {map});
    line->resize(std::max(line->size(), place + 1));
    (*line)[place] = compared(claim, check, scene);
  }
  table.insert(table.begin(), std::move(head));
  return table;
}

}  // namespace

ClaimAnswer judge_claim(const Claim& claim, const ClaimCheck& check, std::span<const ClaimFigures> measured,
                        bool is_software) {
  const auto figures = [&](const std::string& label) -> const ClaimFigures& {
    return measured[claim.row_index(label)];
  };
  const auto not_testable = [&](const std::string& label) {
    const std::string& why = figures(label).untimed;
    return ClaimAnswer{ClaimVerdict::not_testable,
                       fmt::format("{} has no {}{}", label, check.metric,
                                   why.empty() || check.metric != "bake_time" ? "" : ": " + why)};
  };
  const std::optional<double> of = value_of(figures(check.of), check.metric);
  if (!of) return not_testable(check.of);
  const auto answer = [&](bool holds, std::string numbers) {
    if (is_software && is_time(check.metric))
      return ClaimAnswer{ClaimVerdict::not_testable, numbers + " (a software rasteriser's)"};
    return ClaimAnswer{holds ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced, std::move(numbers)};
  };
  if (check.at_most && check.to.empty())
    return answer(*of <= *check.at_most, fmt::format("{:.4g}, at most {:.4g}", *of, *check.at_most));
  const std::string& label = check.than.empty() ? check.to : check.than;
  const std::optional<double> other = value_of(figures(label), check.metric);
  if (!other) return not_testable(label);
  if (!check.than.empty()) return answer(*of < *other, fmt::format("{:.4g} against {:.4g}", *of, *other));
  const double quotient = *of / *other;
  if (check.at_most)
    return answer(quotient <= *check.at_most, fmt::format("{:.4g} against {:.4g}, {:.3g}x; at most {:.3g}x", *of,
                                                          *other, quotient, *check.at_most));
  return answer(std::abs(quotient / check.quotient - 1) <= check.tolerance,
                fmt::format("ours {:.3g}x, the paper's {:.3g}x", quotient, check.quotient));
}

ClaimAnswer judge_in_each(const Claim& claim, const ClaimCheck& check, std::span<const SceneFigures> scenes,
                          bool is_software) {
  std::vector<ClaimAnswer> answers;
  answers.reserve(scenes.size());
  for (const SceneFigures& scene : scenes) answers.push_back(judge_claim(claim, check, scene.rows, is_software));
  if (answers.size() == 1) return answers.front();
  const auto count = [&](ClaimVerdict verdict) { return std::ranges::count(answers, verdict, &ClaimAnswer::verdict); };
  ClaimAnswer all{.verdict = ClaimVerdict::reproduced,
                  .numbers = fmt::format("so in {} of {} scenes", count(ClaimVerdict::reproduced), answers.size())};
  for (const ClaimVerdict worse : {ClaimVerdict::not_testable, ClaimVerdict::not_reproduced})
    if (count(worse) > 0) all.verdict = worse;
  if (check.at_most)
    all.numbers = fmt::format("at most {:.4g}{}, ", *check.at_most, check.to.empty() ? "" : "x") + all.numbers;
  all.table = table_of_scenes(claim, check, scenes);
  return all;
}

}  // namespace reliefbench
