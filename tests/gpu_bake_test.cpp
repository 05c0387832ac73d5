#include "backends/gpu_bake.h"

#include <algorithm>
#include <limits>

#include "kernels/maps/cone_map.h"
#include "tests/backend_rig.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class GpuBakeTest : public BackendTest {};

constexpr std::pair<int, int> kBakeSizes[] = {{2, 2}, {3, 5}, {29, 18}};

GpuBaker baker(const Rig& rig, MapKind kind) { return {*rig.backend, rig.row.dialect, kind}; }

/// Those of the map kind's corrections that a GPU makes.
std::vector<Correction> corrections_of(MapKind kind) {
  std::vector<Correction> both;
  for (const Correction correction : find_map(kind).corrections)
    if (std::ranges::find(gpu_corrections(), correction) != gpu_corrections().end()) both.push_back(correction);
  return both;
}

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
  expect_same_bits(baker.bake(request), find_map(kind).bake(request));
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
            const Heightfield heights = map.make(width, height);
            expect_cpu_bits(gpu, kind, {.heights = heights, .wrap = wrap, .threads = 1});
          }
    }
  });
}

TEST_P(GpuBakeTest, every_correction_and_an_unbounded_ratio_have_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = bricks_map(21, 24);
    const Heightfield long_map = noise_map(24, 9);  // `safe` has another rule there
    for (const MapKind kind : gpu_bakers()) {
      const GpuBaker gpu = baker(rig, kind);
      for (const Correction correction : corrections_of(kind))
        for (const float max_ratio : {1.0F, kUnboundedRatio}) {
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

TEST_P(GpuBakeTest, a_map_of_several_dispatches_has_the_bits_of_the_cpu) {
  on_every_device([](Rig& rig) {
    const Heightfield heights = fbm_map(11, 300);
    expect_cpu_bits(baker(rig, MapKind::conservative), MapKind::conservative, {.heights = heights, .threads = 1});
  });
}

TEST_P(GpuBakeTest, what_the_cpu_refuses_is_refused) {
  on_every_device([](Rig& rig) {
    const Heightfield line = constant_map(1, 8);
    const Heightfield heights = constant_map(4, 4);
    EXPECT_THROW((void)baker(rig, MapKind::height), Error);
    const GpuBaker gpu = baker(rig, MapKind::relaxed_po07);
    EXPECT_THROW((void)gpu.bake({.heights = line}), Error);
    EXPECT_THROW((void)gpu.bake({.heights = heights, .correction = Correction::safe}), Error);
    EXPECT_THROW((void)gpu.bake({.heights = heights, .parameters = {{kSearchSteps.id, 0}}}), Error);
  });
}

TEST_P(GpuBakeTest, a_buffer_over_the_devices_limit_is_an_environment_error_that_names_the_device) {
  on_every_device([](Rig& rig) {
    const Spirv spirv = compile_baker(MapKind::conservative, rig.row.dialect);
    const auto pipeline = rig.backend->compile_compute({.label = "huge", .spirv = spirv, .inputs = 2});
    constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max() / 4;
    const std::array<std::byte, 8> some{};
    const ComputeJob job{.pipeline = pipeline.get(), .inputs = {some, some}, .output_bytes = kHuge};
    EXPECT_THAT(message_of([&] { (void)rig.backend->compute(job); }),
                AllOf(HasSubstr(std::to_string(kHuge)), HasSubstr(rig.backend->device().name)));
  });
}

TEST(GpuBake, the_null_backend_has_no_compute) {
  const auto backend = open_null(0, {});
  EXPECT_THAT(message_of([&] { (void)backend->compile_compute({.label = "bake", .spirv = {}}); }),
              HasSubstr("null: no compute"));
  EXPECT_THAT(message_of([&] { (void)backend->compute({}); }), HasSubstr("null: no compute"));
  EXPECT_THAT(message_of([&] { (void)GpuBaker(*backend, Dialect::vulkan, MapKind::conservative); }),
              HasSubstr("double precision"));
}

INSTANTIATE_TEST_SUITE_P(Backends, GpuBakeTest, ::testing::Values("opengl", "vulkan"), backend_name);

}  // namespace
}  // namespace reliefbench
