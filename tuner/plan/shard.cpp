#include "tuner/plan/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <compare>
#include <set>
#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

/// A case whatever its backend, by what it shares with its neighbours. The scene comes last: frames of one map may
/// differ in size, and so in cost.
struct ShardUnit {
  std::string bake;
  std::string setting;
  std::string scene;
  auto operator<=>(const ShardUnit&) const = default;  // NOLINT(modernize-use-nullptr): there is none
};

ShardUnit unit_of(const Case& c, const Config& config) {
  const auto scene = std::ranges::find(config.scenes, c.scene_id, &SceneSpec::id);
  return {.bake = bake_text(c.settings, *scene),
          .setting = fmt::format("{}?{}", c.settings.technique().id, c.settings.text()),
          .scene = c.scene_id};
}

/// Whether no map is baked on both sides.
bool is_border(const std::vector<ShardUnit>& units, std::size_t at) {
  return at == 0 || at == units.size() || units[at - 1].bake != units[at].bake;
}

/// Where the shards after the first `count` begin: at the border of two maps that is nearest to the even division, if
/// one is near.
std::size_t end_of(const std::vector<ShardUnit>& units, int count, int of) {
  constexpr std::size_t kNear = 8;  // a shard's eighth
  const auto shards = static_cast<std::size_t>(of);
  const std::size_t even = units.size() * static_cast<std::size_t>(count) / shards;
  for (std::size_t distance = 0; distance <= units.size() / shards / kNear; ++distance)
    for (const std::size_t at : {even - std::min(even, distance), std::min(units.size(), even + distance)})
      if (is_border(units, at)) return at;
  return even;
}

}  // namespace

std::string Shard::text() const { return fmt::format("{}/{}", index, of); }

Shard parse_shard(std::string_view text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  const bool has_slash = first.ec == std::errc{} && first.ptr != end && *first.ptr == '/';
  const auto second = std::from_chars(has_slash ? first.ptr + 1 : end, end, shard.of);
  if (!has_slash || second.ec != std::errc{} || second.ptr != end || shard.index < 1 || shard.index > shard.of)
    fail_input("'{}' is no shard: expected I/N, I from 1 to N, e.g. 2/7", text);
  return shard;
}

Plan shard_of(const Plan& plan, const Config& config, const Shard& shard) {
  std::vector<ShardUnit> of_cases;
  of_cases.reserve(plan.cases.size());
  for (const Case& c : plan.cases) of_cases.push_back(unit_of(c, config));
  std::vector<ShardUnit> units = of_cases;
  std::ranges::sort(units);
  units.erase(std::unique(units.begin(), units.end()), units.end());
  if (units.size() < static_cast<std::size_t>(shard.of))
    fail_input("{}: {} shards are too many for {} settings of scenes", config.path.string(), shard.of, units.size());

  const std::size_t begin = end_of(units, shard.index - 1, shard.of);
  const std::size_t end = end_of(units, shard.index, shard.of);
  Plan part{.cases = {}, .bakes = {}, .conflicts = plan.conflicts};
  std::set<std::string> bakes;
  for (std::size_t i = 0; i < plan.cases.size(); ++i) {
    if (of_cases[i] < units[begin] || (end < units.size() && !(of_cases[i] < units[end]))) continue;
    part.cases.push_back(plan.cases[i]);
    if (bakes.insert(of_cases[i].bake).second) part.bakes.push_back(of_cases[i].bake);
  }
  return part;
}

}  // namespace reliefbench
