#include "tuner/measure/bake.h"

#include <fmt/format.h>

#include <utility>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/image/heightmaps.h"
#include "tuner/results/stages.h"

namespace reliefbench {
namespace {

std::string bake_key(const MapRow& map, const BakeRequest& request) {
  return stage_key({bake_stage(map.id)},
                   {heights_sha256(request.heights), wrap_id(request.wrap), correction_id(request.correction),
                    fmt::format("{}", request.max_ratio), parameters_text(request, map)});
}

}  // namespace

BakeSpec bake_spec(const Settings& settings, Wrap wrap) {
  return {.storage = storage_of(settings), .wrap = wrap, .parameters = map_values(settings)};
}

BakedValues timed_bake(const std::function<std::vector<float>()>& make) {
  const double start_ns = steady_ns();
  std::vector<float> values = make();
  return {.time_ns = steady_ns() - start_ns, .values = std::move(values)};
}

BakedValues bake_on_cpu(const MapRow& map, const BakeRequest& request, const std::string& /*key*/) {
  return timed_bake([&] { return map.bake(request); });
}

BakedMap bake(const BakeSpec& spec, const Heightfield& heights, const Baker& baker) {
  const MapStorage& storage = spec.storage;
  BakedMap map{.heights = quantise_heights(heights, storage.format.type)};
  if (storage.map.is_solid && !heights.is_solid())
    fail_input("{}: the heightmap has one height a texel; a solid needs two (\"floor\" says where the second one is)",
               storage.map.id);
  if (!storage.map.is_solid) map.heights.floors.clear();  // it sees the upper surface alone
  const BakeRequest request{.heights = map.heights,
                            .wrap = spec.wrap,
                            .correction = storage.correction,
                            .max_ratio = storage.max_ratio,
                            .parameters = spec.parameters,
                            .threads = spec.threads};
  map.key = bake_key(storage.map, request);
  if (storage.map.content == MapContent::heights) return map;
  BakedValues baked = baker(storage.map, request, map.key);
  map.values = std::move(baked.values);
  map.bake_time_ns = baked.time_ns;
  return map;
}

}  // namespace reliefbench
