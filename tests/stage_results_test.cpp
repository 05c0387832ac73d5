// What stages make of fixed inputs, to the bit (errors to six digits): where a result changes, its stage's version
// must.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "kernels/base/sha256.h"
#include "kernels/judge/score.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/map_texture.h"
#include "tests/test_heightmap.h"
#include "tuner/results/stages.h"

namespace reliefbench {
namespace {

/// Heights without a library's functions, which may round otherwise on another machine.
Heightfield fixed_heights() {
  Heightfield heights{.width = 20, .height = 14, .texels = {}};
  for (int y = 0; y < heights.height; ++y)
    for (int x = 0; x < heights.width; ++x)
      heights.texels.push_back(static_cast<float>(8 * x * (19 - x) + 5 * (7 * y % heights.height)) / 1024.0F);
  return heights;
}

template <typename Values>
std::string digest(const Values& values) {
  return sha256(std::as_bytes(std::span(values))).substr(0, 12);
}

std::vector<TextureRay> fixed_rays() {
  std::vector<TextureRay> rays;
  for (int i = 0; i < 200; ++i)
    rays.push_back({.u = static_cast<float>(i) / 200,
                    .v = static_cast<float>(i * 7 % 50) / 50,
                    .slope_u = static_cast<float>(i % 9 - 4) / 8,
                    .slope_v = static_cast<float>(i % 5 - 2) / 4});
  return rays;
}

std::vector<Correction> corrections_of(const MapRow& map) {
  if (map.corrections.empty()) return {Correction::none};
  return {map.corrections.begin(), map.corrections.end()};
}

/// stage -> digest of its results
std::map<std::string, std::string> results() {
  std::map<std::string, std::string> all;
  const Heightfield heights = fixed_heights();
  Heightfield solid = heights;
  for (const float height : heights.texels) solid.floors.push_back(0.75F * height);
  for (const MapRow& map : map_kinds()) {
    if (map.content == MapContent::heights) continue;
    BakeRequest request{.heights = map.is_solid ? solid : heights,
                        .parameters = map.kind == MapKind::distance
                                          ? std::vector<MapValue>{{.param = kDistanceSlices.id, .value = 8}}
                                          : std::vector<MapValue>{}};
    std::vector<float> values;
    for (const Correction correction : corrections_of(map))
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        request.correction = correction;
        request.wrap = wrap;
        const std::vector<float> baked = map.bake(request);
        values.insert(values.end(), baked.begin(), baked.end());
      }
    all[bake_stage(map.id)] = digest(values);
  }
  std::string codes;
  std::string levels;
  const MapRow& cones = find_map(MapKind::conservative);
  const std::vector<float> ratios = cones.bake({.heights = heights});
  for (const Encoding& encoding : encodings())
    for (const char* format : {"rg8", "rg16", "rg16f"})
      codes += digest(
          pack_map({.map = cones, .heights = heights, .values = ratios}, find_format(format), encoding).relief.texels);
  for (const char* format : {"rg8", "rgba8"}) {
    const MapTextures packed =
        pack_map({.map = cones, .heights = heights, .values = ratios, .mips = Mips::conservative}, find_format(format),
                 encodings().front());
    levels += digest(packed.relief.texels);
  }
  all["encode"] = digest(codes);
  all["pack"] = digest(levels);
  std::string hits;
  std::string errors;
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    const std::vector<TextureRay> rays = fixed_rays();
    const std::vector<ReferenceHit> exact = ReferenceTracer(heights, wrap).trace(rays);
    std::vector<ScorePixel> pixels;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      hits += fmt::format("{} {}\n", exact[i].t_enter, exact[i].t_exit);
      pixels.push_back({.ray = rays[i],
                        .t = static_cast<float>(exact[i].t_enter) * (i % 3 == 0 ? 1.25F : 0.875F),
                        .status = static_cast<float>(i % 3),
                        .taps = static_cast<float>(i % 7)});
    }
    const FrameScore score = judge(pixels, exact, heights.width, heights.height).score;
    for (const char* id :
         {"e_xy.mean", "e_xy.p99", "e_z.mean", "e_z.max", "missed_rate", "inside_rate", "unconverged_rate"})
      errors += fmt::format("{:.6g} ", find_metric(id).value(score).value());
    errors += fmt::format("{}\n", score.pixels);
  }
  // Pictures are compared in float, which differs in the last digits from one instruction set to the next.
  std::vector<std::uint8_t> shown[2];
  for (int i = 0; i < 4 * 20 * 14; ++i) {
    shown[0].push_back(static_cast<std::uint8_t>(i * 37 % 251));
    shown[1].push_back(static_cast<std::uint8_t>(i * 37 % 251 / 2 + i % 90));
  }
  FrameScore pictures;
  judge_pictures({.reference = shown[0], .test = shown[1], .width = 20, .height = 14},
                 {.has_ray = UnfilledVector<std::uint8_t>(20 * 14, 1), .count = 20 * 14}, pictures);
  errors += fmt::format("{:.6g} {:.3f} {:.3f}", pictures.at("psnr"), pictures.at("flip"), pictures.at("ssim"));
  all["reference"] = digest(hits);
  all["judge"] = digest(errors);
  return all;
}

TEST(StageResults, change_only_with_their_stages_version) {
  const std::map<std::string, std::string> known = {{"bake.conservative 2", "58e230021a94"},
                                                    {"bake.distance 1", "cf15f55a8744"},
                                                    {"bake.double_cone 1", "357d10a853b4"},
                                                    {"bake.double_mip 2", "52952e383c2b"},
                                                    {"bake.hybrid 1", "bf9297445a2d"},
                                                    {"bake.max_mip 1", "5760accbfaab"},
                                                    {"bake.omni 1", "5b7c7b404ac8"},
                                                    {"bake.quad 2", "d1d1db2c3262"},
                                                    {"bake.quadtree 1", "b4ea60fd8e89"},
                                                    {"bake.quick 1", "7969b3ea3110"},
                                                    {"bake.quick_centre 1", "37b7c67f69f4"},
                                                    {"bake.quick_naive 1", "3441afbb209a"},
                                                    {"bake.quick_published 1", "7969b3ea3110"},
                                                    {"bake.relaxed 1", "59161b1174dd"},
                                                    {"bake.relaxed_po07 2", "c10e66ad695b"},
                                                    {"bake.safety_shape 1", "646e3d55bf82"},
                                                    {"bake.cell 1", "d780a965349d"},
                                                    {"bake.sector 2", "68e0b00960af"},
                                                    {"bake.sector_relaxed 1", "089f5974992c"},
                                                    {"encode 2", "793ed6fe46e0"},
                                                    {"judge 6", "be14e8339c85"},
                                                    {"pack 1", "518f06010e87"},
                                                    {"reference 2", "5fbb2ce04c31"}};
  std::map<std::string, int> versions;
  for (const StageVersion& stage : stage_versions()) versions[stage.id] = stage.version;
  for (const auto& [stage, result] : results()) {
    const std::string versioned = fmt::format("{} {}", stage, versions.at(stage));
    const auto found = known.find(versioned);
    EXPECT_TRUE(found != known.end() && found->second == result)
        << "the results of stage '" << stage << "' changed: raise its version (tuner/results/stages.cpp, or its row), "
        << "and note here {\"" << stage << " VERSION\", \"" << result << "\"},";
  }
}

}  // namespace
}  // namespace reliefbench
