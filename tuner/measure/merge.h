#pragma once
#include <filesystem>
#include <span>

#include "tuner/results/join.h"

namespace reliefbench {

/// Joins run folders into a new one, as join() says, with their pictures. The folder is written beside its place and
/// then renamed, so that it is there as a whole or not at all.
/// returns: the run in its place. throws: Error: as join(); output is there and not empty; a folder that stands twice
[[nodiscard]] JoinedRuns merge_runs(std::span<const std::filesystem::path> folders,
                                    const std::filesystem::path& output);

}  // namespace reliefbench
