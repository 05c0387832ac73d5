#include "backends/gpu_bake.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <limits>
#include <numeric>

#include "kernels/maps/cone_map.h"
#include "kernels/maps/sector_map.h"
#include "kernels/maps/verify_cones.h"
#include "tests/backend_rig.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class GpuBakeTest : public BackendTest {};

constexpr std::pair<int, int> kBakeSizes[] = {{2, 2}, {3, 5}, {29, 18}};

GpuBaker baker(const Rig& rig, MapKind kind) { return {*rig.backend, rig.row.dialect, kind}; }

/// The CPU's bits, with what is wrong in words if they are not.
void expect_same_bits(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  std::size_t above = 0;
  std::size_t below = 0;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] > expected[i]) ++above;
    if (found[i] < expected[i]) ++below;
    if (std::abs(found[i] - expected[i]) > std::abs(found[worst] - expected[worst])) worst = i;
  }
  EXPECT_TRUE(above + below == 0) << above << " above, " << below << " below; texel " << worst << ": " << found[worst]
                                  << ", expected " << expected[worst];
}

void expect_cpu_bits(const GpuBaker& baker, MapKind kind, const BakeRequest& request) {
  expect_same_bits(baker.bake(request).values, find_map(kind).bake(request));
}

TEST_P(GpuBakeTest, every_baker_has_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    for (const MapKind kind : gpu_bakers()) {
      const GpuBaker gpu = baker(rig, kind);
      for (const ConeTestMap& map : kConeTestMaps)
        for (const auto& [width, height] : kBakeSizes)
          for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
            SCOPED_TRACE(
                fmt::format("{} {} {}x{} wrap {}", find_map(kind).id, map.id, width, height, static_cast<int>(wrap)));
            const Heightfield heights = heights_for(kind, map.make(width, height));
            expect_cpu_bits(gpu, kind, {.heights = heights, .wrap = wrap, .threads = 1});
          }
    }
  });
}

TEST_P(GpuBakeTest, every_correction_and_an_unbounded_ratio_have_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    for (const MapKind kind : gpu_bakers()) {
      const Heightfield heights = heights_for(kind, bricks_map(21, 24));
      const Heightfield long_map = heights_for(kind, noise_map(24, 9));  // `safe` has another rule there
      const GpuBaker gpu = baker(rig, kind);
      for (const Correction correction : find_map(kind).corrections)
        for (const float max_ratio : {1.0F, kUnboundedRatio}) {
          const bool has_wedges = find_map(kind).ratios > 1 || find_map(kind).content == MapContent::sectors;
          if (has_wedges && max_ratio > 1) continue;  // theirs are at most 1
          SCOPED_TRACE(fmt::format("{} {} up to {}", find_map(kind).id, correction_id(correction), max_ratio));
          for (const Heightfield* map : {&heights, &long_map})
            expect_cpu_bits(gpu, kind,
                            {.heights = *map, .correction = correction, .max_ratio = max_ratio, .threads = 1});
        }
    }
  });
}

TEST_P(GpuBakeTest, the_steps_of_the_exit_search_count) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = fbm_map(24, 24);
    const GpuBaker gpu = baker(rig, MapKind::relaxed_po07);
    for (const int steps : {1, 3, 64, 127})
      expect_cpu_bits(gpu, MapKind::relaxed_po07,
                      {.heights = heights, .parameters = {{kSearchSteps.id, steps}}, .threads = 1});
  });
}

// As on hardware; software rasterisers walk rays in packets.
TEST_P(GpuBakeTest, workgroups_that_walk_the_rays_of_a_texel_together_have_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    const GpuBaker gpu(*rig.backend, rig.row.dialect, MapKind::relaxed_po07, BakeDevice{.is_software = false});
    for (const ConeTestMap& map : kConeTestMaps)
      for (const auto& [width, height] : kBakeSizes)
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
          for (const int steps : {1, 64}) {
            SCOPED_TRACE(
                fmt::format("{} {}x{} wrap {} {} steps", map.id, width, height, static_cast<int>(wrap), steps));
            const Heightfield heights = map.make(width, height);
            expect_cpu_bits(gpu, MapKind::relaxed_po07,
                            {.heights = heights,
                             .wrap = wrap,
                             .correction = Correction::min3x3,
                             .max_ratio = kUnboundedRatio,
                             .parameters = {{kSearchSteps.id, steps}},
                             .threads = 1});
          }
  });
}

// Under clamp those on the borders see more than their sector.
TEST_P(GpuBakeTest, every_count_of_sectors_has_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    std::size_t number = 0;
    for (const MapKind kind : {MapKind::sector, MapKind::sector_relaxed}) {
      const GpuBaker gpu = baker(rig, kind);
      for (const auto& [width, height] : {std::pair(19, 24), std::pair(32, 16)})
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp})
          for (const Correction correction : find_map(kind).corrections)
            for (const int sectors : {1, 2}) {  // 8, 16
              if (!is_tried_here(rig, number++)) continue;
              SCOPED_TRACE(fmt::format("{} {}x{} wrap {} {} {}", find_map(kind).id, width, height,
                                       static_cast<int>(wrap), correction_id(correction), 4 << sectors));
              const Heightfield heights = bricks_map(width, height);
              expect_cpu_bits(gpu, kind,
                              {.heights = heights,
                               .wrap = wrap,
                               .correction = correction,
                               .parameters = {{kSectors.id, sectors}},
                               .threads = 1});
            }
    }
    const Heightfield coprime = noise_map(4099, 4093);
    EXPECT_THAT(
        message_of([&] {
          static_cast<void>(baker(rig, MapKind::sector).bake({.heights = coprime, .parameters = {{kSectors.id, 2}}}));
        }),
        HasSubstr("4099x4093 texels, whose sides have no large divisor in common, are too many"));
  });
}

TEST_P(GpuBakeTest, a_map_of_several_dispatches_has_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = fbm_map(521, 514);  // sides over 2^9: a deep pyramid, most of its last nodes outside
    for (const MapKind kind : {MapKind::conservative, MapKind::quick, MapKind::max_mip})
      expect_cpu_bits(baker(rig, kind), kind, {.heights = heights});
  });
}

TEST_P(GpuBakeTest, without_doubles_no_ratio_is_above_the_cpus_and_none_far_under_it) {
  on_every_device([](Rig& rig) {
    const Heightfield bricks = bricks_map(48, 48);
    const Heightfield long_map = fbm_map(96, 64);  // 1.5 times as long as wide: most of a distance is slack
    for (const MapKind kind :
         {MapKind::conservative, MapKind::relaxed, MapKind::hybrid, MapKind::quick, MapKind::quick_published,
          MapKind::quick_centre, MapKind::quad, MapKind::sector, MapKind::cell}) {
      const GpuBaker gpu(*rig.backend, rig.row.dialect, kind, BakeDevice{.has_doubles = false});
      for (const Heightfield* heights : {&bricks, &long_map})
        for (const Correction correction : find_map(kind).corrections) {
          if (correction == Correction::certified) continue;  // the next test's
          SCOPED_TRACE(fmt::format("{} {}", find_map(kind).id, correction_id(correction)));
          const BakeRequest request{.heights = *heights, .correction = correction};
          const std::vector<float> found = gpu.bake(request).values;
          const std::vector<float> expected = find_map(kind).bake(request);
          int most_ulps = 0;
          for (std::size_t i = 0; i < found.size(); ++i)
            most_ulps = std::max(most_ulps, std::bit_cast<int>(expected[i]) - std::bit_cast<int>(found[i]));
          EXPECT_TRUE(std::ranges::equal(found, expected, std::less_equal<>()));
          EXPECT_LE(most_ulps, kMostUlpsUnder);
        }
    }
    EXPECT_THROW(GpuBaker(*rig.backend, rig.row.dialect, MapKind::relaxed_po07, BakeDevice{.has_doubles = false}),
                 Error);
  });
}

TEST_P(GpuBakeTest, certified_cones_have_the_bits_of_the_cpu_where_the_map_ends_and_where_odd_sides_repeat) {
  on_every_device([](Rig& rig) {
    const GpuBaker gpu = baker(rig, MapKind::conservative);
    std::size_t number = 0;
    for (const ConeTestMap& map : kConeTestMaps)
      for (const auto& [width, height] : {std::pair(2, 2), std::pair(3, 5), std::pair(24, 9), std::pair(29, 18)})
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
          if (!is_tried_here(rig, number++)) continue;
          SCOPED_TRACE(fmt::format("{} {}x{} wrap {}", map.id, width, height, static_cast<int>(wrap)));
          const Heightfield heights = map.make(width, height);
          expect_cpu_bits(gpu, MapKind::conservative,
                          {.heights = heights, .wrap = wrap, .correction = Correction::certified, .threads = 1});
        }
  });
}

TEST_P(GpuBakeTest, without_doubles_certified_cones_hold_and_are_as_wide) {
  on_every_device([](Rig& rig) {
    const GpuBaker gpu(*rig.backend, rig.row.dialect, MapKind::conservative, BakeDevice{.has_doubles = false});
    for (const ConeTestMap& map : kConeTestMaps) {
      SCOPED_TRACE(map.id);
      const Heightfield heights = map.make(29, 18);
      const BakeRequest request{.heights = heights, .correction = Correction::certified, .threads = 1};
      const std::vector<float> found = gpu.bake(request).values;
      const StoredCones cones(heights, found, find_encoding("ratio"), Wrap::repeat, false);
      const CellVerdict cells = verify_cells({.cones = cones, .threads = 1}, 8);
      EXPECT_EQ(cells.proved, cells.cells);
      const std::vector<float> expected = bake_conservative(request);
      const double width = std::reduce(found.begin(), found.end(), 0.0);
      EXPECT_NEAR(width, std::reduce(expected.begin(), expected.end(), 0.0), 1e-4 * width);
    }
  });
}

TEST_P(GpuBakeTest, the_parts_of_a_bake_are_timed_in_their_order) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = fbm_map(64, 64);
    const GpuBake bake = baker(rig, MapKind::conservative).bake({.heights = heights, .correction = Correction::safe});
    std::vector<std::string> parts;
    for (const ComputeTime& time : bake.times) {
      parts.push_back(time.part);
      EXPECT_GE(time.ns, 0) << time.part;
    }
    EXPECT_THAT(parts, ElementsAre("upload", "pyramid", "search", "correction", "read_back"));
  });
}

/// From the pit no ray leaves the plateau again: all of them are walked, most to the pit's own height.
Heightfield pit_map() {
  Heightfield heights{.width = 128, .height = 128, .texels = std::vector<float>(128 * 128, 0.9F)};
  heights.texels[5000] = 0;
  return heights;
}
const MapValue kManySteps{kSearchSteps.id, 512};

// llvmpipe leaves loops after 65,535 turns.
TEST_P(GpuBakeTest, a_packet_that_takes_more_turns_than_a_software_rasteriser_makes_goes_on_in_the_next_pass) {
  on_every_device([](Rig& rig) {
    if (!rig.backend->device().software) return;
    const Heightfield heights = pit_map();
    expect_cpu_bits(baker(rig, MapKind::relaxed_po07), MapKind::relaxed_po07,
                    {.heights = heights, .parameters = {kManySteps}});
  });
}

TEST_P(GpuBakeTest, a_search_that_the_device_cuts_short_is_an_environment_error) {
  on_every_device([](Rig& rig) {
    if (!rig.backend->device().software) return;
    const Heightfield heights = pit_map();
    const GpuBaker gpu(*rig.backend, rig.row.dialect, MapKind::relaxed_po07, BakeDevice{.is_software = false});
    expect_cpu_bits(gpu, MapKind::relaxed_po07, {.heights = heights, .parameters = {{kSearchSteps.id, 16}}});
    const GpuBaker packing(*rig.backend, rig.row.dialect, MapKind::relaxed_po07, BakeDevice{.is_software = false},
                           BakePacking{.format = find_format("rg8"), .encoding = find_encoding("ratio")});
    for (const GpuBaker* one : {&gpu, &packing})
      EXPECT_THAT(message_of([&] { (void)one->bake({.heights = heights, .parameters = {kManySteps}}); }),
                  AllOf(HasSubstr("relaxed_po07"), HasSubstr(rig.backend->device().name)));
  });
}

TEST_P(GpuBakeTest, what_the_cpu_refuses_is_refused) {
  on_every_device([](Rig& rig) {
    const Heightfield line = constant_map(1, 8);
    const Heightfield heights = constant_map(4, 4);
    EXPECT_THROW((void)baker(rig, MapKind::height), Error);
    EXPECT_THROW((void)baker(rig, MapKind::double_mip).bake({.heights = heights}), Error);  // it has no floors
    const GpuBaker gpu = baker(rig, MapKind::relaxed_po07);
    EXPECT_THROW((void)gpu.bake({.heights = line}), Error);
    EXPECT_THROW((void)gpu.bake({.heights = heights, .correction = Correction::safe}), Error);
    EXPECT_THROW((void)gpu.bake({.heights = heights, .parameters = {{kSearchSteps.id, 0}}}), Error);
  });
}

TEST_P(GpuBakeTest, a_buffer_over_the_devices_limit_is_an_environment_error_that_names_the_device) {
  on_every_device([](Rig& rig) {
    constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max() / 4;
    const ComputeJob job{.buffers = {{.bytes = kHuge}}};
    const bool is_vulkan = rig.row.dialect == Dialect::vulkan;
    EXPECT_THAT(message_of([&] { (void)rig.backend->compute(job); }),
                AllOf(HasSubstr(std::to_string(kHuge)), HasSubstr(rig.backend->device().name),
                      HasSubstr(is_vulkan ? "(maxStorageBufferRange)" : "(GL_MAX_SHADER_STORAGE_BLOCK_SIZE)")));
    if (!is_vulkan) return;
    // None of them is too large, all of them are.
    const ComputeJob many{.buffers =
                              std::vector<ComputeBuffer>(std::size_t{1} << 20U, {.bytes = std::size_t{1} << 26U})};
    EXPECT_THAT(message_of([&] { (void)rig.backend->compute(many); }),
                AllOf(HasSubstr("bytes in all of a job's buffers"), HasSubstr(rig.backend->device().name),
                      HasSubstr("(maxMemoryAllocationSize)")));
  });
}

TEST(GpuBake, the_null_backend_has_no_compute) {
  const auto backend = open_null(0, {});
  EXPECT_THAT(message_of([&] { (void)backend->compile_compute({.label = "bake", .spirv = {}}); }),
              HasSubstr("null: no compute"));
  EXPECT_THAT(message_of([&] { (void)backend->compute({}); }), HasSubstr("null: no compute"));
  EXPECT_THAT(message_of([&] { (void)GpuBaker(*backend, Dialect::vulkan, MapKind::conservative); }),
              HasSubstr("null: no compute"));
  EXPECT_THAT(message_of([&] { (void)GpuBaker(*backend, Dialect::vulkan, MapKind::safety_shape); }),
              HasSubstr("double precision"));
}

INSTANTIATE_TEST_SUITE_P(Backends, GpuBakeTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
