#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

/// In a part: others hold all of its cases, so that the merged run has no times of it.
inline constexpr const char* kAddsNothing = "adds_nothing";

/// What run.json of a merged run keeps of the runs that it was made from, each an object: "folder", "identity", "host",
/// "started", ..., "devices" with timer and control case, "cases" of its plan and how many "records" it has. Of a run
/// that is not merged: itself.
[[nodiscard]] std::vector<nlohmann::json> parts_of(const Run& run);

/// What a part is known by, wherever its folder lies, however far it has come and whoever went on with it: a hash of
/// its identity and of the nanosecond in which it was started; "" where it does not tell its start.
[[nodiscard]] std::string part_key(const nlohmann::json& part);
/// Of the parts that a run has times of, as far as they have one. info: run.json
[[nodiscard]] std::vector<std::string> part_keys(const nlohmann::json& info);

/// Which shards of a plan are not there, or not finished, for people: "shards 2, 5 of 7 are missing". Where one
/// division of a plan is whole, nothing is missing of it.
[[nodiscard]] std::string missing_of(std::span<const nlohmann::json> parts);
/// What finishes a run that is not, for people.
[[nodiscard]] std::string how_to_finish(const Run& run);

}  // namespace reliefbench
