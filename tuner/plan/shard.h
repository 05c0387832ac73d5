#pragma once
#include <string>
#include <string_view>

#include "tuner/plan/plan.h"

namespace reliefbench {

/// One of the parts that a plan is divided into, so that many machines may share it.
struct Shard {
  int index = 1;  ///< from 1 to `of`
  int of = 1;
  [[nodiscard]] std::string text() const;  ///< "2/7"
};
[[nodiscard]] Shard parse_shard(std::string_view text);  ///< throws: Error(bad_input)

/// A shard's cases, in the plan's order. Each case is in one shard, on whatever backends; the settings of a scene that
/// share a baked map are neighbours, and where a shard would begin a little beside the first of a map's, it begins
/// there. So N shards of B maps bake at most B + N - 1, and their sizes differ from the mean by at most a quarter. What
/// the plan holds decides, not its order, the machine or which backends that has.
/// config: the plan's. throws: Error(bad_input): more shards than settings of scenes
[[nodiscard]] Plan shard_of(const Plan& plan, const Config& config, const Shard& shard);

}  // namespace reliefbench
