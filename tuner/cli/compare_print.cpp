#include "tuner/cli/compare_print.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/console.h"
#include "tuner/cli/format.h"
#include "tuner/decide/compare_text.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostErrorRows = 20;  // one screen, unless --all

std::string painted(Change change, const Paint& paint) {
  const std::string_view id = change_id(change);
  if (change == Change::slower) return paint.bad(id);
  return change == Change::faster ? paint.good(id) : paint.dim(id);
}

/// What changed or is unclear of it; with `all`, everything.
template <typename T, typename Name>
void print_changes(std::span<const T> changes, std::string_view column, const Name& name, bool with_unclear, bool all,
                   const Paint& paint) {
  std::vector<std::vector<std::string>> rows = {{"change", "ratio", "95 % interval", "p", std::string(column)}};
  for (const T& c : changes) {
    const bool is_told =
        c.change == Change::slower || c.change == Change::faster || (with_unclear && c.change == Change::unclear);
    if (!all && !is_told) continue;
    rows.push_back({painted(c.change, paint), fmt::format("{:.3f}", c.ratio.ratio),
                    fmt::format("[{:.3f}, {:.3f}]", c.ratio.low, c.ratio.high), fmt::format("{:.2g}", c.p), name(c)});
  }
  if (rows.size() > 1) put("{}\n", columns(rows));
}

std::string group_text(const GroupChange& group) {
  return fmt::format("{}, geometric mean of {}", group.group, group.cases);
}

void print_times(const Comparison& comparison, bool all, const Names& names, const Paint& paint) {
  print_changes(
      std::span<const CaseChange>(comparison.cases), "case",
      [&](const CaseChange& c) { return names.whole_case(c.case_id); }, /*with_unclear=*/false, all, paint);
  print_changes(std::span(comparison.groups).subspan(1), "cases that may move together", group_text,
                /*with_unclear=*/true, all, paint);
  const GroupChange& whole = comparison.groups.front();
  put("{}: {}\n", comparison.metric, count_text(comparison));
  put("geometric mean of the ratios {:.4f} [{:.4f}, {:.4f}]: {}\n", whole.ratio.ratio, whole.ratio.low,
      whole.ratio.high, painted(whole.change, paint));
  for (const auto& [backend, ratio] : comparison.control_ratio) {
    put("control case on {}: {:.4f}, raw: what changed for the whole device\n", backend, ratio);
  }
  for (const auto& [backend, deviation] : comparison.between_runs)
    put("{}\n", paint.dim(fmt::format("a case on {} shifts by {:.2g} % from run to run without a cause", backend,
                                      100 * deviation)));
  for (const std::string& assumed : comparison.assumed) put("{}\n", paint.dim("assumed: " + assumed));
  for (const std::string& driver : comparison.drivers) put("{}\n", paint.bold("another driver on " + driver));
}

void print_doubts(const Comparison& comparison, const std::string& settle, const Paint& paint) {
  for (const std::string& doubt : doubt_texts(comparison)) put("{}\n", "in doubt: " + doubt);
  if (verdict_id(comparison) == "inconclusive")
    put("{}\n", paint.bad("inconclusive: the intervals are too wide to exclude a change that matters"));
  if (settle.empty()) return;
  put("the doubtful cases measured again, in turns, would tell:\n");
  put_command("  " + settle);
}

std::string value_text(std::optional<double> value) { return value ? format_number(*value) : "(identical)"; }

void print_metrics(std::string_view what, std::vector<ErrorChange> changes, bool all, const Names& names,
                   const Paint& paint) {
  if (changes.empty()) return;
  std::stable_partition(changes.begin(), changes.end(), [](const ErrorChange& e) { return e.worse; });
  const std::size_t shown = all ? changes.size() : std::min(changes.size(), kMostErrorRows);
  std::vector<std::vector<std::string>> rows = {{"change", "metric", "base", "new", "case"}};
  for (std::size_t i = 0; i < shown; ++i) {
    const ErrorChange& e = changes[i];
    const std::string_view id = error_change_id(e);
    rows.push_back({e.worse ? paint.bad(id) : (e.counts_work ? std::string(id) : paint.good(id)), e.metric,
                    value_text(e.base), value_text(e.now), names.whole_case(e.case_id)});
  }
  put("\n{}:\n{}", what, columns(rows));
  if (shown < changes.size()) put("... and {} more (--all)\n", changes.size() - shown);
}

void print_errors(const Comparison& comparison, bool all, const Names& names, const Paint& paint) {
  std::vector<ErrorChange> errors = comparison.errors;
  const auto work =
      std::stable_partition(errors.begin(), errors.end(), [](const ErrorChange& e) { return !e.counts_work; });
  std::vector<ErrorChange> counts(work, errors.end());
  errors.erase(work, errors.end());
  if (errors.empty()) put("errors: none changed\n");
  print_metrics("errors", std::move(errors), all, names, paint);
  print_metrics("work, which is no error", std::move(counts), all, names, paint);
}

void print_unmatched(std::string_view what, const std::vector<std::string>& ids, bool all, const Names& names) {
  if (ids.empty()) return;
  put("{} cases {}{}\n", ids.size(), what, all ? ":" : " (--all lists them)");
  if (!all) return;
  for (const std::string& id : ids) put("  {}\n", names.whole_case(id));
}

void print_environment(const Comparison& comparison) {
  if (comparison.environment.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"environment", "base", "new"}};
  for (const EnvironmentDifference& difference : comparison.environment) {
    std::vector<std::string>& row = rows.emplace_back();
    row.push_back(difference.what);
    for (const std::string& value : difference.values) row.push_back(value.empty() ? "(not recorded)" : value);
  }
  put("\n{}\n", columns(rows));
}

}  // namespace

void print_comparison(const Comparison& comparison, const CompareDetail& detail, const std::string& settle) {
  const Paint paint = paint_for_stdout();
  if (!comparison.cases.empty()) print_times(comparison, detail.all, detail.names, paint);
  print_environment(comparison);
  if (!comparison.cases.empty()) print_doubts(comparison, settle, paint);
  if (comparison.matched > 0) print_errors(comparison, detail.all, detail.names, paint);
  for (const std::string& lost : comparison.lost) put("{} {}\n", paint.bad("lost"), lost);
  print_unmatched("only in base", comparison.only_base, detail.all, detail.names);
  print_unmatched("only in new", comparison.only_new, detail.all, detail.names);
  if (comparison.matched == 0) print_error("no case was measured in both runs: nothing is compared");
}

}  // namespace reliefbench
