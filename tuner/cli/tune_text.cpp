#include "tuner/cli/tune_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "reports/pages/tune_page.h"
#include "tuner/cli/fleet_text.h"
#include "tuner/cli/format.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

/// A setting's name, with the mark of a coarse filter.
std::string name_of(const TuneResult& result, const Names& names, const std::string& setting) {
  return fmt::format("{}{}", names.setting(setting), result.filter.mark(setting));
}

/// What the answer is for.
void print_subject(const TuneResult& result) {
  for (const std::string& subject : result.subjects) put("  for {}\n", subject);
}

std::string interval(double time_ns, double high_ns) {
  return fmt::format("{} (at most {})", format_time_ns(time_ns), format_time_ns(high_ns));
}

/// Why there is no pick, and what comes nearest to one.
void print_miss(const TuneResult& result, std::string_view what, const Names& names) {
  put("\n{}{}{}\n", what, result.miss.empty() ? "" : ": ", result.miss);
  if (!result.nearest.empty()) put("  nearest: {}\n", name_of(result, names, result.nearest));
}

void print_space(const TuneResult& result) {
  const TuneCounts& counts = result.counts;
  put("{} settings", counts.settings);
  if (!result.replayed.empty()) put(" of {}", result.replayed);
  put(", {}, {}\n", result.backend, result.device);
  if (counts.is_bisected)
    put("  errors by bisection: {} scored; {} taken to be no faster than a scored one with fewer steps; {} miss "
        "the budgets as more steps do\n",
        counts.scored, counts.assumed, counts.hopeless);
  if (counts.failed > 0) put("  {} could not be drawn\n", counts.failed);
  if (const auto valued = std::ssize(result.space.candidates); counts.scored > valued)
    put("  {} have no value of {}: left out\n", counts.scored - valued, result.error_metric);
}

void print_certificate(const TuneResult& result, const Paint& paint) {
  const SearchResult& search = result.search;
  const auto assumed = std::ranges::count(search.states, Evidence::assumed, &CandidateState::evidence);
  put("  {} of {} settings timed, {} ruled out by fewer steps of the same chain (slack {})\n", search.measured,
      result.space.candidates.size(), assumed, gap_text(search.slack));
  if (search.samples > 0)
    put("  {} samples, those of a round correlated by at most {:.2f}\n", search.samples, search.correlation);
  put("  {} audits of what was ruled out, {} wrong\n", search.audits, search.audit_failures);
  put("  {}\n", result.is_certified() ? paint.good(result.claim()) : paint.bad(result.claim()));
}

void print_answers(const TuneResult& result, const Paint& paint, const Names& names) {
  if (result.search.answers.size() < 2) return;
  const std::string within = result.counts.unscored > 0 ? "within, of those scored" : "within";
  std::vector<std::vector<std::string>> rows{
      {paint.bold(result.error_metric + " at most"), paint.bold("time"), paint.bold(within), paint.bold("setting")}};
  for (const BudgetAnswer& answer : result.search.answers)
    rows.push_back({format_number(result.space.candidates[answer.pick].error), format_time_ns(answer.time_ns),
                    gap_text(answer.gap), name_of(result, names, result.space.candidates[answer.pick].id)});
  put("\n{}\n", columns(rows));
}

void print_rungs(const TuneResult& result, const Names& names) {
  if (result.rungs.empty()) return;
  put("\nFrom the fewest features that do to the fastest:\n");
  double before_ns = 0;
  for (const TuneRung& rung : result.rungs) {
    put("  {}  {}\n", format_time_ns(rung.time_ns), name_of(result, names, rung.setting));
    if (before_ns > 0)
      put("      {:.1f} % less time for {}{}{}\n", 100 * (1 - rung.time_ns / before_ns), fmt::join(rung.gained, ", "),
          rung.dropped.empty() ? "" : ", without ", fmt::join(rung.dropped, ", "));
    before_ns = rung.time_ns;
  }
}

void print_scenes(const TuneResult& result, const Paint& paint, const Names& names) {
  if (!result.scene_answers.empty()) put("\nEach scene by itself:\n");
  for (const SceneAnswer& answer : result.scene_answers) {
    if (!answer.own) {
      put("  {}: no answer\n", answer.scene);
      continue;
    }
    if (answer.own->setting == result.pick->setting) {
      put("  {}: {}, the common pick: nothing was seen to be faster there\n", answer.scene,
          format_time_ns(answer.common_ns));
      continue;
    }
    put("  {}: {}, {:.1f} % less than the common pick's {} there (between {:.1f} and {:.1f} %)\n      {}\n",
        answer.scene, format_time_ns(answer.own_ns), 100 * answer.gain, format_time_ns(answer.common_ns),
        100 * answer.gain_low, 100 * answer.gain_high, name_of(result, names, answer.own->setting));
  }
  if (!result.holdout.empty()) put("\nThe pick on what it was not tuned on:\n");
  for (const HoldoutAnswer& answer : result.holdout) {
    const std::string verdict = !answer.failure.empty() ? paint.bad(answer.failure)
                                : answer.miss.empty()   ? paint.good("meets the budgets")
                                                        : paint.bad(answer.miss);
    const std::string unmeasured = answer.error ? "" : fmt::format(", {} not measured", result.error_metric);
    const std::string drawn = fmt::format("{}, {}", unmeasured, format_time_ns(answer.time_ns));
    put("  {}: {}{}\n", answer.scene, verdict, answer.failure.empty() ? drawn : "");
  }
}

void print_common(const TuneResult& result, const Paint& paint, const Names& names) {
  if (!result.fleet_refusal.empty()) put("\n{}: {}\n", paint.bad("no setting for all devices"), result.fleet_refusal);
  if (!result.fleet) return;
  put("\n");
  print_fleet(result.fleet->fleet, result.fleet->options, names);
  for (const std::string& text : result.fleet->fleet.repeated) put("{}\n", paint.dim(text));
  put("{}\n",
      paint.dim(fmt::format("Of all that were scored, timed or not: none loses less than {}, this one at most {}.",
                            gap_text(result.fleet->low), gap_text(result.fleet->high))));
}

}  // namespace

void print_tune_result(const TuneResult& result, const Names& names) {
  const Paint paint = paint_for_stdout();
  print_space(result);
  print_subject(result);
  if (result.pick) {
    put("\n{} {}\n", paint.bold("pick"), paint.good(name_of(result, names, result.pick->setting)));
    put("  {}   {} {}   within {} of the best{}\n", interval(result.pick->time_ns, result.pick->high_ns),
        result.error_metric, format_number(result.pick->error), gap_text(result.pick->gap),
        result.counts.unscored > 0 ? " of those scored" : "");
    if (!result.pick->tie.empty())
      put("  tie with {}:\n  the pick is the simpler or smaller of settings that time does not tell apart\n",
          name_of(result, names, result.pick->tie));
  } else if (result.is_stopped) {
    put("\n{}\n", paint.bad("no pick yet: stopped too early"));
  } else {
    print_miss(result, paint.bad(result.search.is_feasible ? "no pick" : "nothing meets the budgets"), names);
  }
  print_certificate(result, paint);
  print_rungs(result, names);
  print_answers(result, paint, names);
  print_scenes(result, paint, names);
  print_common(result, paint, names);
  if (!result.filter.note().empty()) put("\n{}\n", paint.dim(result.filter.note()));
  for (const std::string& note : result.frame_notes) put("\n{}\n", paint.dim(note));
}

void print_next_commands(const TuneResult& result, const std::string& folder) {
  if (folder.empty() || !result.pick) return;
  const std::string key = setting_key(parse_setting(result.pick->setting));
  const std::string run = shell_quoted(folder);
  const std::string scene = result.scenes.size() > 1 ? " --scene " + shell_quoted(result.scenes.front()) : "";
  put("\nnext:\n");
  put_command(fmt::format("  reliefbench view --run {} --case {}{}", run, key, scene));
  put_command(fmt::format("  reliefbench export --run {} --case {}{} -o {}", run, key, scene,
                          shell_quoted(fmt::format("{}/shipped", folder))));
}

}  // namespace reliefbench
