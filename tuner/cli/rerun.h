#pragma once
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tuner/decide/confirm.h"

namespace CLI {
class App;
}

namespace reliefbench {

inline constexpr int kMostRounds = 10'000;
/// --rounds of a re-run, kLeastRounds to kMostRounds. words: of what; their default is told beside
void add_rounds_option(CLI::App& command, int& rounds, const std::string& words);

/// One of two builds that are measured in turns.
struct RerunBuild {
  std::string name;     ///< of its folders: "good"
  std::string label;    ///< for people: "the good build"
  std::string command;  ///< of a shell; leaves a run at $OUT
};
struct RerunPlan {
  RerunBuild first;
  RerunBuild second;  ///< its re-runs are the bad ones
  int rounds = 3;     ///< of first, second, second, first; kLeastRounds to kMostRounds
  std::filesystem::path output;
  bool quiet = false;
  /// Looks at what a command left, before the next one is started. throws: Error
  std::function<void(const std::filesystem::path&)> check = [](const std::filesystem::path&) {};
};

/// Measures both builds in turns, in a folder each under `output`; a run that is there already counts, so that what was
/// killed goes on. keys: rerun_key() of the series that are asked for
/// throws: Error(bad_input): a command left nothing; Error(environment): it failed
[[nodiscard]] std::vector<Rerun> rerun_in_turns(const RerunPlan& plan, const std::set<std::string>& keys);

}  // namespace reliefbench
