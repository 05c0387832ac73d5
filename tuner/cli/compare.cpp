#include "tuner/decide/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "kernels/base/console.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/names.h"
#include "tuner/cli/options.h"

namespace reliefbench {
namespace {

struct CompareArguments {
  std::string base;
  std::string now;
  CompareOptions options;
  bool all = false;
  Names names;
  bool json = false;
};

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
  const auto count = [&](Change change) { return std::ranges::count(comparison.cases, change, &CaseChange::change); };
  const GroupChange& whole = comparison.groups.front();
  put("{}: {} slower, {} faster, {} same, {} unclear of {} cases\n", comparison.metric, count(Change::slower),
      count(Change::faster), count(Change::same), count(Change::unclear), comparison.matched);
  put("geometric mean of the ratios {:.4f} [{:.4f}, {:.4f}]: {}\n", whole.ratio.ratio, whole.ratio.low,
      whole.ratio.high, painted(whole.change, paint));
  for (const auto& [backend, ratio] : comparison.control_ratio) {
    put("control case on {}: {:.4f}, raw: what changed for the whole device\n", backend, ratio);
  }
  for (const auto& [backend, deviation] : comparison.between_runs)
    put("{}\n", paint.dim(fmt::format("a case on {} shifts by {:.2g} % from run to run without a cause", backend,
                                      100 * deviation)));
  for (const std::string& assumed : comparison.assumed) put("{}\n", paint.dim("assumed: " + assumed));
  if (is_inconclusive(comparison))
    put("{}\n", paint.bad("inconclusive: the intervals are too wide to exclude a change that matters; measure "
                          "with more samples, or on a quieter machine"));
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

Exit compare_command(const CompareArguments& arguments) {
  if (!std::isfinite(arguments.options.threshold) || arguments.options.threshold <= 0) {
    fail_input("--threshold {}: expected a share above 0, e.g. 0.05", arguments.options.threshold);
  }
  const Comparison comparison = compare_runs(load_run(arguments.base), load_run(arguments.now), arguments.options);
  const Exit result = exit_of(comparison);
  for (const std::string& warning : comparison.warnings) print_error("warning: " + warning);
  if (arguments.json) {
    fmt::print("{}\n", comparison_json(comparison).dump(2));
    return result;
  }
  const Paint paint = paint_for_stdout();
  if (!comparison.cases.empty()) print_times(comparison, arguments.all, arguments.names, paint);
  if (comparison.matched > 0) print_errors(comparison, arguments.all, arguments.names, paint);
  for (const std::string& lost : comparison.lost) put("{} {}\n", paint.bad("lost"), lost);
  print_unmatched("only in base", comparison.only_base, arguments.all, arguments.names);
  print_unmatched("only in new", comparison.only_new, arguments.all, arguments.names);
  if (comparison.matched == 0) print_error("no case was measured in both runs: nothing is compared");
  return result;
}

}  // namespace

void add_compare_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("compare", "what changed between two runs of one device");
  const CLI::Option* base = command->add_option("BASE", "folder of the earlier run")->required();
  const CLI::Option* now = command->add_option("NEW", "folder of the later run")->required();
  const CLI::Option* metric =
      command
          ->add_option("--metric", "frame_time (relative to the control case), frame_time_raw, or an error metric's id")
          ->type_name("ID");
  const CLI::Option* threshold =
      command->add_option("--threshold", "change that matters, as a share; 0.05")->type_name("SHARE");
  const CLI::Option* all = add_switch(*command, "--all", "every case, not only the changed ones");
  const CLI::Option* verbose = add_switch(*command, "--verbose", Names::kHelp);
  const CLI::Option* json = add_switch(*command, "--json", "as JSON");
  command->footer(
      "Besides each case, those of a technique, a map, a format and all are compared as one, by the geometric mean of\n"
      "their ratios, which shows smaller changes. `same`: the interval lies within the threshold; `slower`, `faster`: "
      "it\n"
      "does not, and chance is no explanation at 5 % for all that was looked at together.\n"
      "Exit code 1 where a case or a group is slower, a case is lost or an error is worse; 4 where the evidence is "
      "too\n"
      "little: a group or most cases are unclear; 5 where no case matches.\n"
      "Example:\n  reliefbench compare out/yesterday out/today");
  command->callback([=, &exit_code] {
    CompareOptions options;
    options.metric = value_or(metric, options.metric);
    options.threshold = value_or(threshold, options.threshold);
    exit_code = static_cast<int>(compare_command({.base = base->as<std::string>(),
                                                  .now = now->as<std::string>(),
                                                  .options = options,
                                                  .all = is_set(all),
                                                  .names = {.verbose = is_set(verbose)},
                                                  .json = is_set(json)}));
  });
}

}  // namespace reliefbench
