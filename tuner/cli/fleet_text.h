#pragma once
#include "tuner/cli/names.h"
#include "tuner/decide/fleet.h"

namespace reliefbench {

/// The pick, what it loses in each place, and what it costs to ship the best of one place in another.
void print_fleet(const Fleet& fleet, const FleetOptions& options, const Names& names);

}  // namespace reliefbench
