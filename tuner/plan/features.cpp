#include "tuner/plan/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

#include "kernels/maps/texel.h"

namespace reliefbench {
namespace {

bool is_plain(const Settings& settings, const SettingValue& given) {
  if (given.param.id == "format") return storage_of(settings).format.type == TexelType::unorm8;
  return given.value == given.param.min;
}

}  // namespace

std::vector<std::string> features(const Settings& settings) {
  std::vector<std::string> list;
  const MapRow& map = map_of(settings);
  if (map.content != MapContent::heights) list.push_back(fmt::format("map={}", map.id));
  for (const SettingValue& given : settings.values())
    if (!given.param.choices.empty() && given.param.id != "map" && !is_plain(settings, given))
      list.push_back(fmt::format("{}={}", given.param.id, given.text()));
  return list;
}

std::vector<std::size_t> ladder(std::span<const RungCandidate> candidates) {
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) {
    const RungCandidate& candidate = candidates[i];
    return std::tuple(candidate.features.size(), candidate.time_ns, candidate.simplicity, i);
  });
  std::vector<std::size_t> rungs;
  double fastest_ns = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (!(candidates[i].time_ns < fastest_ns)) continue;
    fastest_ns = candidates[i].time_ns;
    rungs.push_back(i);
  }
  return rungs;
}

}  // namespace reliefbench
