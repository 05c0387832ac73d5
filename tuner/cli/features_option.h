#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tuner/results/record.h"

namespace reliefbench {

/// Adds --features, by the names that `require` answers with.
void add_features_option(CLI::App& command, std::string& features);

/// Only settings that show these features stay. run: for messages
/// throws: Error(bad_input): no such feature; nothing stays
void keep_features(std::vector<Record>& records, const std::string& features, const std::string& run);

}  // namespace reliefbench
