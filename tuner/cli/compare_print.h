#pragma once
#include <span>

#include "tuner/cli/names.h"
#include "tuner/decide/compare.h"
#include "tuner/decide/hardware.h"

namespace reliefbench {

/// What of a comparison is told.
struct CompareDetail {
  bool all = false;  ///< every case, not only the changed ones
  Names names{};
};
/// One device twice. settle: the command that would say more of what is in doubt; "": nothing is, or none would
void print_comparison(const Comparison& comparison, const CompareDetail& detail, const std::string& settle);

/// Devices, drivers or backends beside each other.
void print_hardware(const HardwareComparison& comparison, std::span<const FleetRun> runs, const CompareDetail& detail);

}  // namespace reliefbench
