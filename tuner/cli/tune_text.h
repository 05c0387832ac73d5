#pragma once
#include <string>

#include "tuner/tune/tune.h"

namespace reliefbench {

/// Prints what a search found: the scenes that it answers for, the pick, the certificate, the ladder, the answers.
/// verbose: settings by their whole ids
void print_tune_result(const TuneResult& result, bool verbose);

/// Prints the commands that come next. folder: of the run; "": nothing was kept
void print_next_commands(const TuneResult& result, const std::string& folder);

}  // namespace reliefbench
