#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

/// Several runs as one.
// NOLINTNEXTLINE(bugprone-exception-escape): of the moving that nobody wrote, which throws nothing
struct JoinedRuns {
  /// As load_run() gives a run, but for its folder. run.json has "parts": what every machine's run was.
  Run run;
  std::vector<std::string> left_out;  ///< folders whose cases others hold, all of them: parts without samples
  std::size_t held_twice = 0;         ///< records of a case that an earlier folder holds, too
  std::string missing;                ///< shards that are not there or not finished, for people; "": none
  double least_control = 1;           ///< the control case's time in a part, as a share of the first part's
  double greatest_control = 1;
};

/// Joins shards, or any runs of one config. These must be equal: schema, kernels, config and injected slowdowns; the
/// device of each backend by name and driver, and where it is a software rasteriser the processor; scenes of one name.
/// These may differ: host, index of the device, timer, filter and shard.
///
/// Of a case that two folders hold, what is deterministic (errors, map, keys, memory) must be equal to the bit, and the
/// times of the earlier folder count, or those of the one in which it did not fail. A case's times are relative to its
/// own machine's control case, and are brought to the speed of the first part's, which is the earliest where no case is
/// held twice.
/// runs: in the order in which they count where they hold a case twice; else the order makes no other run
/// throws: Error(bad_input): two that are not to be joined, in one line that names both; a run of tune; one that has
///         not begun; Error(nothing_measured)
[[nodiscard]] JoinedRuns join(std::vector<Run> runs);

}  // namespace reliefbench
