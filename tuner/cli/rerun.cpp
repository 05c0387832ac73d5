#include "tuner/cli/rerun.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>

#include "kernels/base/error.h"
#include "tuner/history/ingest.h"
#include "tuner/measure/progress.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

/// Runs a build's command with $OUT for what it is to leave there. throws: Error(environment): it failed
void run_build(const std::string& command, const fs::path& out) {
  if (::setenv("OUT", out.c_str(), 1) != 0) fail_environment("OUT cannot be set for '{}'", command);
  const int status = std::system(command.c_str());
  if (status == -1 || !WIFEXITED(status)) fail_environment("'{}' was ended by a signal", command);
  if (WEXITSTATUS(status) != 0) fail_environment("'{}' ended with exit code {}", command, WEXITSTATUS(status));
  if (!fs::exists(out)) fail_input("'{}' left nothing at $OUT ({})", command, out.string());
}

/// What a command left at $OUT; nothing where there is no whole run.
std::optional<Night> rerun_at(const fs::path& out) {
  if (!fs::exists(out)) return std::nullopt;
  try {
    return read_night(out, {});
  } catch (const Error&) {  // killed on its way: it goes on
    return std::nullopt;
  }
}

/// The values of an event's series in a run.
std::map<std::string, double> values_in(const Night& night, const std::set<std::string>& keys) {
  std::map<std::string, double> values;
  for (const Night::Value& value : night.values) {
    const std::string key = rerun_key(value.series);
    if (value.row.is_valid && keys.contains(key)) values[key] = std::log(value.row.value);
  }
  return values;
}

}  // namespace

void add_rounds_option(CLI::App& command, int& rounds, const std::string& words) {
  command.add_option("--rounds", rounds, fmt::format("{}; {}", words, rounds))
      ->type_name("N")
      ->check(CLI::Range(kLeastRounds, kMostRounds));
}

std::vector<Rerun> rerun_in_turns(const RerunPlan& plan, const std::set<std::string>& keys) {
  const int runs = 4 * plan.rounds;
  Progress progress(plan.quiet);
  std::vector<Rerun> reruns;
  for (int i = 0; i < runs; ++i) {
    const bool is_second = i % 4 == 1 || i % 4 == 2;
    const RerunBuild& build = is_second ? plan.second : plan.first;
    progress.update(static_cast<double>(i) / runs, fmt::format("run {} of {}: {}", i + 1, runs, build.label));
    const fs::path out = plan.output / fmt::format("{:02}-{}", i + 1, build.name);
    std::optional<Night> night = rerun_at(out);
    if (!night) {
      run_build(build.command, out);
      night = read_night(out, {});
    }
    plan.check(out);
    reruns.push_back({.is_bad = is_second, .log_values = values_in(*night, keys)});
  }
  progress.finish();
  return reruns;
}

}  // namespace reliefbench
