// `bake` inside this process, on devices that are not what they say.
#include "tuner/measure/bake_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/backend_rig.h"
#include "tests/forwarding_backend.h"

namespace reliefbench {
namespace {

/// Its own clocks run at another speed.
class FastClock final : public ForwardingBackend {
 public:
  using ForwardingBackend::ForwardingBackend;
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    BatchTime time = ForwardingBackend::render(frame, frames, timer);
    if (time.device_ns) *time.device_ns *= 3;
    return time;
  }
};

using BakeJobTest = BackendTest;
INSTANTIATE_TEST_SUITE_P(Backends, BakeJobTest, ::testing::Values("opengl", "vulkan"), backend_name);

TEST_P(BakeJobTest, parts_by_a_clock_that_lies_are_not_told) {
  const BakeJob job{.heightmap = {.source = "fbm", .width = 16, .height = 16},
                    .spec = {.storage = {.map = find_map(MapKind::quick),
                                         .format = find_format("rg8"),
                                         .encoding = find_encoding("ratio")}},
                    .device = std::string(row().id),
                    .output = {},
                    .open = [](const BackendRow& backend, int index) -> std::unique_ptr<Backend> {
                      return std::make_unique<FastClock>(backend.open(index, {}));
                    }};
  const BakeResult result = run_bake(job);
  ASSERT_TRUE(result.clock);
  EXPECT_FALSE(result.clock->valid);
  EXPECT_THAT(result.clock->reason, ::testing::HasSubstr("the fenced wall clock"));
  EXPECT_THAT(result.device_times, ::testing::IsEmpty());
  EXPECT_GT(result.bake_time_ns, 0);
  EXPECT_FALSE(result.pack_time_ns);
}

}  // namespace
}  // namespace reliefbench
