#pragma once
#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tuner/decide/compare.h"

namespace reliefbench {

struct RerunArguments {
  std::string binary_a{};  ///< that measures base; "": this one
  std::string binary_b{};  ///< ... and new
  int rounds = 3;
  std::size_t most_cases = 32;
  std::filesystem::path output{};  ///< "": out/rerun/ and a hash of what is measured
  bool quiet = false;
};

/// Measures what is in doubt again on this machine, both builds in turns, and puts what that says in the place of the
/// first verdicts: of doubtful cases, and of doubtful groups all of whose cases were measured again. Its intervals hold
/// together for all that was measured again.
/// returns: {"cases", "left_out", "rounds", "folder", "same_build"}; "cases" is 0 where nothing is in doubt
/// throws: Error(bad_input): runs that no sweep of this machine can repeat, or two builds of which only one is given
[[nodiscard]] nlohmann::json rerun_doubtful(const Run& base, const Run& now, const CompareOptions& options,
                                            const RerunArguments& arguments, Comparison& comparison);

/// What a re-run can say, and what it can't. rerun: as rerun_doubtful() returns it
void print_rerun(const nlohmann::json& rerun);

/// The command that measures what is in doubt again; "" where nothing is, or where the runs can't be repeated.
[[nodiscard]] std::string settling_command(const Run& base, const Run& now, const Comparison& comparison);

}  // namespace reliefbench
