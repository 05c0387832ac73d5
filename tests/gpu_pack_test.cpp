#include <tuple>

#include "backends/gpu_bake.h"
#include "kernels/maps/map_storage.h"
#include "kernels/maps/sector_map.h"
#include "tests/backend_rig.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

class GpuPackTest : public BackendTest {};

/// The CPU's bytes.
void expect_cpu_textures(const GpuBaker& baker, const MapStorage& storage, const Heightfield& heights, Wrap wrap,
                         const std::vector<MapValue>& parameters = {}) {
  const Heightfield stored = quantise_heights(heights, storage.format.type);
  const BakeRequest request{.heights = stored,
                            .wrap = wrap,
                            .correction = storage.correction,
                            .max_ratio = storage.max_ratio,
                            .parameters = parameters,
                            .threads = 1};
  const std::vector<float> values = storage.map.bake(request);
  const MapTextures expected =
      pack_map({.map = storage.map, .heights = stored, .values = values, .wrap = wrap, .parameters = parameters},
               storage.format, storage.encoding);
  const GpuBake bake = baker.bake(request);
  ASSERT_TRUE(bake.textures);
  const auto expect_same = [](const TextureImage& found, const TextureImage& wanted) {
    EXPECT_EQ(std::tie(found.width, found.height, found.layout, found.levels),
              std::tie(wanted.width, wanted.height, wanted.layout, wanted.levels));
    EXPECT_TRUE(found.texels == wanted.texels);
  };
  expect_same(bake.textures->relief, expected.relief);
  ASSERT_EQ(bake.textures->extra.has_value(), expected.extra.has_value());
  if (expected.extra) expect_same(*bake.textures->extra, *expected.extra);
}

GpuBaker packing_baker(const Rig& rig, const MapStorage& storage) {
  return {*rig.backend, rig.row.dialect, storage.map.kind,
          BakePacking{.format = storage.format, .encoding = storage.encoding}};
}

TEST_P(GpuPackTest, packed_maps_have_the_bytes_of_the_cpu_in_every_format_and_encoding) {
  on_every_device([](Rig& rig) {
    const MapRow& map = find_map(MapKind::quick);
    const Heightfield heights = bricks_map(13, 9);  // texels are no whole number of words
    for (const Format& format : formats())
      for (const Encoding& encoding : encodings()) {
        MapStorage storage{.map = map, .format = format, .encoding = encoding};
        if (is_of_blocks(format.type) || !conflict(storage).empty()) continue;
        const GpuBaker gpu = packing_baker(rig, storage);
        for (const Correction correction : map.corrections)
          for (const float max_ratio : {1.0F, kUnboundedRatio}) {
            storage.correction = correction;
            storage.max_ratio = max_ratio;
            if (!conflict(storage).empty()) continue;
            SCOPED_TRACE(
                fmt::format("{} {} {} up to {}", format.id, encoding.id, correction_id(correction), max_ratio));
            expect_cpu_textures(gpu, storage, heights, Wrap::clamp);
          }
      }
  });
}

TEST_P(GpuPackTest, every_kinds_packed_map_has_the_bytes_of_the_cpu) {
  on_every_device([](Rig& rig) {
    std::size_t number = 0;
    for (const MapKind kind : gpu_bakers())
      for (const Format& format : formats()) {
        const MapRow& map = find_map(kind);
        const MapStorage storage{
            .map = map, .format = format, .encoding = find_encoding("h_tan"), .correction = map.corrections.back()};
        const MapStorage plain{.map = map, .format = format, .encoding = find_encoding("sqrt")};
        const MapStorage& tried = conflict(storage).empty() ? storage : plain;
        if (is_of_blocks(format.type) || !conflict(tried).empty() || !is_tried_here(rig, number++)) continue;
        const GpuBaker gpu = packing_baker(rig, tried);
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
          SCOPED_TRACE(fmt::format("{} {} wrap {}", map.id, format.id, static_cast<int>(wrap)));
          expect_cpu_textures(gpu, tried, heights_for(kind, noise_map(11, 14)), wrap);
        }
      }
    const MapStorage certified{.map = find_map(MapKind::conservative),
                               .format = find_format("rg16"),
                               .encoding = find_encoding("atan"),
                               .correction = Correction::certified};
    expect_cpu_textures(packing_baker(rig, certified), certified, fbm_map(24, 24), Wrap::repeat);
  });
}

TEST_P(GpuPackTest, texels_have_the_opposite_sectors_ratio_too) {
  on_every_device([](Rig& rig) {
    for (const auto& [format, sectors] : {std::pair("rg8", 0), std::pair("rg16", 2), std::pair("rg16f", 1)}) {
      const MapStorage storage{.map = find_map(MapKind::sector),
                               .format = find_format(format),
                               .encoding = find_encoding("ratio"),
                               .correction = Correction::safe};
      const GpuBaker gpu = packing_baker(rig, storage);
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
        expect_cpu_textures(gpu, storage, noise_map(7, 5), wrap, {{kSectors.id, sectors}, {kRatiosATexel.id, 1}});
    }
  });
}

TEST_P(GpuPackTest, what_a_device_cannot_pack_is_left_to_the_cpu) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = fbm_map(16, 16);
    const auto packs = [&](std::string_view format, BakeDevice device) {
      const BakePacking packing{.format = find_format(format), .encoding = find_encoding("ratio")};
      const GpuBaker gpu(*rig.backend, rig.row.dialect, MapKind::quick, device, packing);
      const GpuBake bake = gpu.bake({.heights = heights});
      EXPECT_EQ(bake.values.empty(), bake.textures.has_value());
      return bake.textures.has_value();
    };
    EXPECT_TRUE(packs("rg8", {}));
    EXPECT_FALSE(packs("bc5", {}));
    EXPECT_FALSE(packs("rg8", {.has_doubles = false}));
  });
}

INSTANTIATE_TEST_SUITE_P(Backends, GpuPackTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
