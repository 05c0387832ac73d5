#include "tuner/plan/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

#include "kernels/maps/texel.h"

namespace reliefbench {
namespace {

bool is_plain(const Settings& settings, const Param& param) {
  if (param.id == "map") return map_of(settings).content == MapContent::heights;
  if (param.id == "format") return find_format(settings.choice(param.id)).type == TexelType::unorm8;
  return settings.get(param.id) == param.min;
}

}  // namespace

std::vector<std::string> features(const Settings& settings) {
  std::vector<std::string> list;
  const Technique& technique = settings.technique();
  const MapRow& map = map_of(settings);
  if (map.content != MapContent::heights) list.push_back(fmt::format("map={}", map.id));
  for (const Param& param : technique.params)
    if (!param.choices.empty() && param.id != "map" && settings.is_active(param) && !is_plain(settings, param))
      list.push_back(fmt::format("{}={}", param.id, settings.choice(param.id)));
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
