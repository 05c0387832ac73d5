#include "tuner/plan/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <unordered_set>

#include "kernels/base/error.h"
#include "tuner/plan/setting_names.h"

namespace reliefbench {
namespace {

// Combinations of all sweeps of a plan, and cases on all scenes and backends: a slip of the pen, not a plan, is bigger.
constexpr std::size_t kPlanLimit = 1'000'000;

std::size_t combination_count(const SweepSpec& sweep, const std::filesystem::path& path) {
  std::size_t product = 1;
  std::size_t longest = 1;
  for (const Axis& axis : sweep.axes) {
    longest = std::max(longest, axis.values.size());
    if (!sweep.zip && product > kPlanLimit / axis.values.size())
      fail_input("{}:{}: the sweep of '{}' has over {} combinations", path.string(), sweep.line, sweep.technique->id,
                 kPlanLimit);
    product *= axis.values.size();
  }
  return sweep.zip ? longest : product;
}

void check_combinations(const Config& config) {
  std::size_t combinations = 0;
  for (const SweepSpec& sweep : config.sweeps) {
    combinations += combination_count(sweep, config.path);
    if (combinations > kPlanLimit)
      fail_input("{}:{}: with the sweep of '{}' the plan has over {} combinations", config.path.string(), sweep.line,
                 sweep.technique->id, kPlanLimit);
  }
}

/// The settings of combination `index`: the last axis of a product moves fastest.
Settings combination(const SweepSpec& sweep, std::size_t index) {
  Settings settings(*sweep.technique);
  for (auto axis = sweep.axes.rbegin(); axis != sweep.axes.rend(); ++axis) {
    const std::size_t length = axis->values.size();
    const std::vector<int>& tuple = axis->values[sweep.zip && length == 1 ? 0 : index % length];
    for (std::size_t i = 0; i < tuple.size(); ++i) settings.set(axis->params[i], tuple[i]);
    if (!sweep.zip) index /= length;
  }
  return settings;
}

using Terms = std::vector<std::pair<std::string, std::vector<int>>>;

/// Whether every term holds; an inactive parameter has no value, and the answer for it is `if_inactive`.
bool all_hold(const Terms& terms, const Settings& settings, bool if_inactive) {
  return std::ranges::all_of(terms, [&](const auto& term) {
    const auto& [param, allowed] = term;
    if (!settings.is_active(*settings.technique().find(param))) return if_inactive;
    return std::ranges::find(allowed, settings.get(param)) != allowed.end();
  });
}

bool allowed(const std::vector<WhereRule>& rules, const Settings& settings) {
  return std::ranges::all_of(rules, [&](const WhereRule& rule) {
    return !all_hold(rule.when, settings, false) || all_hold(rule.then, settings, true);
  });
}

/// What is left of one sweep, without duplicates.
struct Expansion {
  std::vector<Settings> kept{};
  std::vector<std::string> conflicts{};  ///< what makes no sense, with the reason
  std::size_t combinations = 0;
  std::size_t by_where = 0;  ///< left out by rules
};

Expansion expand(const SweepSpec& sweep, const std::filesystem::path& path) {
  Expansion expansion{.combinations = combination_count(sweep, path)};
  std::unordered_set<std::string> seen;
  for (std::size_t i = 0; i < expansion.combinations; ++i) {
    Settings settings = combination(sweep, i);
    if (!allowed(sweep.where, settings)) {
      ++expansion.by_where;
      continue;
    }
    const std::string text = settings.text();
    if (!seen.insert(text).second) continue;
    if (const std::string reason = conflict(settings); !reason.empty())
      expansion.conflicts.push_back(fmt::format("{}?{}: {}", sweep.technique->id, text, reason));
    else
      expansion.kept.push_back(std::move(settings));
  }
  return expansion;
}

/// throws: Error(bad_input): nothing is left
void check_kept(const Expansion& expansion, const SweepSpec& sweep, const std::filesystem::path& path) {
  if (!expansion.kept.empty()) return;
  fail_input("{}:{}: the sweep of '{}': all of its {} combinations are left out, {} by 'where'{}", path.string(),
             sweep.line, sweep.technique->id, expansion.combinations, expansion.by_where,
             expansion.conflicts.empty() ? "" : ", others as conflicts: " + expansion.conflicts.back());
}

struct Planned {
  Case planned;
  std::size_t backend = 0;  // index
  std::size_t scene = 0;    // index
  std::string bake;
  std::string id;
};

}  // namespace

bool has_settings(const SweepSpec& sweep, const std::filesystem::path& path) {
  return !expand(sweep, path).kept.empty();
}

bool glob_matches(std::string_view pattern, std::string_view text) {
  std::size_t p = 0;
  std::size_t t = 0;
  std::size_t star = std::string_view::npos;  // the last '*' met, and what of the text it has swallowed up to
  std::size_t swallowed = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      swallowed = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++swallowed;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

Plan make_plan(const Config& config, std::span<const std::string> backend_ids, std::string_view filter,
               std::string_view key) {
  Plan plan;
  std::vector<Planned> all;
  std::unordered_set<std::string> seen;
  std::string example;
  check_combinations(config);
  std::size_t cases = 0;
  for (const SweepSpec& sweep : config.sweeps) {
    const Expansion expansion = expand(sweep, config.path);
    check_kept(expansion, sweep, config.path);
    plan.conflicts.insert(plan.conflicts.end(), expansion.conflicts.begin(), expansion.conflicts.end());
    const std::vector<Settings>& kept = expansion.kept;
    cases += kept.size() * config.scenes.size() * backend_ids.size();
    if (cases > kPlanLimit)
      fail_input("{}:{}: with the sweep of '{}' the plan has over {} cases: {} settings on {} scenes and {} backends",
                 config.path.string(), sweep.line, sweep.technique->id, kPlanLimit, kept.size(), config.scenes.size(),
                 backend_ids.size());
    for (std::size_t b = 0; b < backend_ids.size(); ++b)
      for (std::size_t s = 0; s < config.scenes.size(); ++s)
        for (const Settings& settings : kept) {
          Planned planned{.planned = {.settings = settings, .scene_id = config.scenes[s].id, .backend = backend_ids[b]},
                          .backend = b,
                          .scene = s,
                          .bake = {},
                          .id = {}};
          planned.id = planned.planned.id();
          if (const std::string reason =
                  conflict(settings, config.scenes[s].scene, is_solid(config.scenes[s].heightmap));
              !reason.empty()) {
            plan.conflicts.push_back(fmt::format("{}: {}", planned.id, reason));
            continue;
          }
          if (!seen.insert(planned.id).second) continue;
          if (example.empty()) example = planned.id;
          if (!filter.empty() && !glob_matches(filter, planned.id)) continue;
          if (!key.empty() && setting_key(settings) != key) continue;
          planned.bake = bake_text(planned.planned.settings, config.scenes[s]);
          all.push_back(std::move(planned));
        }
  }
  if (all.empty()) {
    if (seen.empty() && !plan.conflicts.empty())
      fail_input("{}: no case: {}", config.path.string(), plan.conflicts.front());
    if (seen.empty()) fail_input("{}: no case: there is no backend to run it on", config.path.string());
    const std::string asked = key.empty()      ? fmt::format("filter '{}'", filter)
                              : filter.empty() ? fmt::format("key '{}'", key)
                                               : fmt::format("filter '{}' with the key '{}'", filter, key);
    fail_input("{}: the {} matches none of the {} cases, e.g. not {}", config.path.string(), asked, seen.size(),
               example);
  }
  std::ranges::sort(plan.conflicts);
  plan.conflicts.erase(std::unique(plan.conflicts.begin(), plan.conflicts.end()), plan.conflicts.end());

  // Stable, so that the settings keep the order of the config's axes.
  std::ranges::stable_sort(all, {}, [](const Planned& p) { return std::tie(p.backend, p.scene, p.bake); });
  std::set<std::string> bakes;
  for (Planned& planned : all) {
    if (bakes.insert(planned.bake).second) plan.bakes.push_back(planned.bake);
    plan.cases.push_back(std::move(planned.planned));
  }
  return plan;
}

}  // namespace reliefbench
