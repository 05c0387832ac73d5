#pragma once
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tuner/decide/confirm.h"

namespace reliefbench {

/// One of two builds that are measured in turns.
struct RerunBuild {
  std::string name;     ///< of its folders: "good"
  std::string label;    ///< for people: "the good build"
  std::string command;  ///< of a shell; leaves a run at $OUT
};
struct RerunPlan {
  RerunBuild first;
  RerunBuild second;  ///< its re-runs are the bad ones
  int rounds = 3;     ///< of first, second, second, first; at least kLeastRounds
  std::filesystem::path output;
  bool quiet = false;
  /// Looks at what a command left, before the next one is started. throws: Error
  std::function<void(const std::filesystem::path&)> check = [](const std::filesystem::path&) {};
};

/// Measures both builds in turns, in a folder each under `output`; a run that is there already counts, so that what was
/// killed goes on. keys: rerun_key() of the series that are asked for
/// throws: Error(bad_input): too few rounds, a command left nothing; Error(environment): it failed
[[nodiscard]] std::vector<Rerun> rerun_in_turns(const RerunPlan& plan, const std::set<std::string>& keys);

}  // namespace reliefbench
