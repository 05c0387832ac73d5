#pragma once
#include <string>

#include "tuner/cli/names.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

/// Prints what a search found: the scenes that it answers for, the pick, the certificate, the ladder, the answers.
void print_tune_result(const TuneResult& result, const Names& names);

/// Prints the commands that come next. folder: of the run; "": nothing was kept
void print_next_commands(const TuneResult& result, const std::string& folder);

}  // namespace reliefbench
