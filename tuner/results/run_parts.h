#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

/// What run.json of a merged run keeps of the runs that it was made from, each an object: "folder", "identity", "host",
/// "started", ..., "devices" with timer and control case, "cases" of its plan and how many "records" it has. Of a run
/// that is not merged: itself.
[[nodiscard]] std::vector<nlohmann::json> parts_of(const Run& run);

/// What each part of a run is known by, wherever its folder lies and however far it has come: a hash of its identity,
/// its host and the nanosecond in which it was started. Nothing of a part that does not tell its start.
/// info: the run's run.json
[[nodiscard]] std::vector<std::string> part_keys(const nlohmann::json& info);

/// Which shards of a plan are not there, or not finished, for people: "shards 2, 5 of 7 are missing". Where one
/// division of a plan is whole, nothing is missing of it.
[[nodiscard]] std::string missing_of(std::span<const nlohmann::json> parts);

}  // namespace reliefbench
