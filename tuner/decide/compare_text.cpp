#include "tuner/decide/compare_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tuner/decide/markup.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/coarse_filter.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostMarkdownRows = 20;

std::string bound_text(double bound) { return std::isfinite(bound) ? fmt::format("{:.3f}", bound) : "∞"; }

std::string ratio_cells(const RatioInterval& ratio) {
  return fmt::format("{:.3f} | {} to {}", ratio.ratio, bound_text(ratio.low), bound_text(ratio.high));
}

std::string time_row(const std::string& what, std::size_t cases, const TimeChange& change) {
  const bool is_told = change.change == Change::slower || change.change == Change::faster;
  return fmt::format("| {} | {} | {} | {}{}{} | {} |\n", markdown_escaped(what), cases, ratio_cells(change.ratio),
                     is_told ? "**" : "", change_id(change.change), is_told ? "**" : "", reason_id(change.reason));
}

/// A case by its setting's short name; by its id where this registry does not know it.
std::string case_text(const std::string& case_id) {
  try {
    const Case spec = parse_case(case_id);
    return fmt::format("{} in {}, {}", named(spec.settings), spec.scene_id, spec.backend);
  } catch (const Error&) {
    return case_id;
  }
}

std::string environment_table(std::span<const EnvironmentDifference> differences,
                              std::span<const std::string> columns) {
  if (differences.empty()) return "";
  std::string text = "\n| environment |";
  for (const std::string& column : columns) text += fmt::format(" {} |", markdown_escaped(column));
  text += "\n|---|";
  for (std::size_t i = 0; i < columns.size(); ++i) text += "---|";
  text += "\n";
  for (const EnvironmentDifference& difference : differences) {
    text += fmt::format("| {} |", markdown_escaped(difference.what));
    for (const std::string& value : difference.values)
      text += fmt::format(" {} |", value.empty() ? "not recorded" : markdown_escaped(value));
    text += "\n";
  }
  return text;
}

struct JUnitCase {
  std::string group;
  std::string name;
  std::string failure{};
  std::string skipped{};
};

JUnitCase junit_case(std::string group, std::string name, const TimeChange& change) {
  JUnitCase made{.group = std::move(group), .name = std::move(name)};
  const std::string said =
      fmt::format("{} {:.3f} [{}, {}], p {:.2g}: {}", change_id(change.change), change.ratio.ratio,
                  bound_text(change.ratio.low), bound_text(change.ratio.high), change.p, reason_id(change.reason));
  if (change.change == Change::slower) made.failure = said;
  if (change.change == Change::unclear) made.skipped = said;
  return made;
}

}  // namespace

std::string count_text(const Comparison& comparison) {
  const auto count = [&](Change change) { return std::ranges::count(comparison.cases, change, &CaseChange::change); };
  return fmt::format("{} slower, {} faster, {} same, {} unclear of {} cases", count(Change::slower),
                     count(Change::faster), count(Change::same), count(Change::unclear), comparison.matched);
}

std::vector<std::string> doubt_texts(const Comparison& comparison) {
  std::map<Reason, int> counts;
  for (const CaseChange& one : comparison.cases) counts[one.reason] += is_doubtful(one) ? 1 : 0;
  for (const GroupChange& one : comparison.groups) counts[one.reason] += is_doubtful(one) ? 1 : 0;
  std::vector<std::pair<int, Reason>> order;
  for (const auto& [reason, count] : counts)
    if (count > 0) order.emplace_back(-count, reason);
  std::ranges::sort(order);
  std::vector<std::string> texts;
  texts.reserve(order.size());
  for (const auto& [count, reason] : order)
    texts.push_back(fmt::format("{} {}: {}", -count, reason_id(reason), reason_text(reason)));
  return texts;
}

std::string front_text(const FrontSetting& one, std::size_t column) {
  const std::string_view mark = coarse_mark(*one.rows[column]);
  if (one.on_front[column]) return fmt::format("front{}", mark);
  if (!one.behind[column]) return fmt::format("not within{}", mark);
  return fmt::format("{:.1f} % slower{}{}", 100 * *one.behind[column], one.may_be[column] ? " (?)" : "", mark);
}

std::string compare_markdown(const Comparison& comparison, std::string_view base, std::string_view now) {
  std::string text =
      fmt::format("**reliefbench compare**: {}; {}, {} against {}\n", verdict_id(comparison),
                  comparison.cases.empty() ? fmt::format("{} cases", comparison.matched) : count_text(comparison),
                  markdown_escaped(now), markdown_escaped(base));
  if (!comparison.groups.empty()) {
    text += fmt::format("\n| {} | cases | ratio | 95 % interval | verdict | why |\n|---|---:|---:|---|---|---|\n",
                        markdown_escaped(comparison.metric));
    for (const GroupChange& group : comparison.groups) text += time_row(group.group, group.cases, group);
    std::size_t rows = 0;
    for (const CaseChange& one : comparison.cases) {
      if (one.change != Change::slower && one.change != Change::faster) continue;
      if (++rows <= kMostMarkdownRows) text += time_row(case_text(one.case_id), 1, one);
    }
    if (rows > kMostMarkdownRows) text += fmt::format("\nand {} changed cases more\n", rows - kMostMarkdownRows);
  }
  std::size_t worse = 0;
  for (const ErrorChange& error : comparison.errors) {
    if (!error.worse || ++worse > kMostMarkdownRows) continue;
    text += fmt::format("\n- **worse** {} of {}", markdown_escaped(error.metric),
                        markdown_escaped(case_text(error.case_id)));
  }
  if (worse > kMostMarkdownRows) text += fmt::format("\n- and {} worse errors more", worse - kMostMarkdownRows);
  for (const std::string& lost : comparison.lost) text += fmt::format("\n- **lost** {}", markdown_escaped(lost));
  if (text.back() != '\n') text += '\n';
  const std::vector<std::string> columns = {std::string(base), std::string(now)};
  text += environment_table(comparison.environment, columns);
  for (const std::string& warning : comparison.warnings) text += fmt::format("\n> {}\n", markdown_escaped(warning));
  return text;
}

std::string hardware_markdown(const HardwareComparison& comparison, std::span<const FleetRun> runs) {
  std::string text = "**reliefbench compare**, time of the second over the first:\n\n";
  text += "| pair | cases of | n | ratio | 95 % interval | nine in ten | rank correlation |\n";
  text += "|---|---|---:|---:|---|---|---|\n";
  for (const DevicePair& pair : comparison.pairs)
    for (const PairGroup& group : pair.groups) {
      std::string ranks;
      if (&group == pair.groups.data())
        for (const RankCorrelation& rank : pair.ranks)
          ranks += fmt::format("{}{:.3f} ({})", ranks.empty() ? "" : ", ", rank.rho, markdown_escaped(rank.scene));
      text += fmt::format("| {} / {} | {} | {} | {} | {:.3f} to {:.3f} | {} |\n", column_letter(pair.now),
                          column_letter(pair.base), markdown_escaped(group.group), group.cases,
                          ratio_cells(group.ratio), group.low_case, group.high_case, ranks);
    }
  std::vector<std::string> columns;
  text += "\n";
  for (std::size_t c = 0; c < comparison.columns.size(); ++c) {
    columns.push_back(column_letter(c));
    text += fmt::format("- {}: {}\n", markdown_escaped(column_text(comparison, c)),
                        markdown_escaped(runs[comparison.columns[c].runs.front()].name));
  }
  for (const SceneFronts& scene : comparison.fronts) {
    text += fmt::format("\n| fronts in {} |", markdown_escaped(scene.scene));
    for (const std::size_t column : scene.columns) text += fmt::format(" {} |", column_letter(column));
    text += "\n|---|";
    for (std::size_t c = 0; c < scene.columns.size(); ++c) text += "---|";
    text += "\n";
    for (std::size_t i = 0; i < std::min(scene.on_some.size(), kMostMarkdownRows); ++i) {
      const FrontSetting& one = scene.on_some[i];
      text += fmt::format("| {} |", markdown_escaped(named(one.settings)));
      for (std::size_t c = 0; c < one.behind.size(); ++c) text += fmt::format(" {} |", front_text(one, c));
      text += "\n";
    }
    if (scene.on_some.size() > kMostMarkdownRows)
      text += fmt::format("\nand {} settings more\n", scene.on_some.size() - kMostMarkdownRows);
  }
  text += environment_table(comparison.environment, columns);
  for (const std::string& warning : comparison.warnings) text += fmt::format("\n> {}\n", markdown_escaped(warning));
  for (const std::string& note : coarse_notes(comparison)) text += fmt::format("\n> {}\n", markdown_escaped(note));
  return text;
}

std::string compare_junit(const Comparison& comparison) {
  std::vector<JUnitCase> cases;
  for (const GroupChange& group : comparison.groups) cases.push_back(junit_case("group", group.group, group));
  for (const CaseChange& one : comparison.cases) cases.push_back(junit_case("case", one.case_id, one));
  for (const ErrorChange& error : comparison.errors)
    if (error.worse)
      cases.push_back({.group = "error", .name = error.metric + " of " + error.case_id, .failure = "worse"});
  for (const std::string& lost : comparison.lost) cases.push_back({.group = "lost", .name = lost, .failure = "lost"});
  std::string body;
  int failures = 0;
  int skipped = 0;
  for (const JUnitCase& one : cases) {
    const std::string open =
        fmt::format("    <testcase classname=\"reliefbench.compare.{}\" name=\"{}\"", one.group, xml_escaped(one.name));
    failures += one.failure.empty() ? 0 : 1;
    skipped += one.skipped.empty() ? 0 : 1;
    if (!one.failure.empty())
      body += fmt::format("{}>\n      <failure message=\"{}\"/>\n    </testcase>\n", open, xml_escaped(one.failure));
    else if (!one.skipped.empty())
      body += fmt::format("{}>\n      <skipped message=\"{}\"/>\n    </testcase>\n", open, xml_escaped(one.skipped));
    else
      body += open + "/>\n";
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"reliefbench compare\" "
      "tests=\"{}\" "
      "failures=\"{}\" skipped=\"{}\">\n{}  </testsuite>\n</testsuites>\n",
      cases.size(), failures, skipped, body);
}

}  // namespace reliefbench
