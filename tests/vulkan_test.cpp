// What is Vulkan's own; what holds for every backend is in backend_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>

#include "backends/shader_compiler.h"
#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"
#include "kernels/base/error.h"
#include "tests/scoped_variable.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::environment);
    return error.what();
  }
  return "no error";
}

/// A camera that looks straight down.
FrameUniforms frame_of(int width, int height) {
  return {.position = {0.5F, 0.5F, 1.5F, 0.1F},
          .right = {0.4F, 0, 0, 1},
          .up = {0, 0.4F, 0, 0},
          .forward = {0, 0, -1, 0},
          .light = {0, 0, 1, 0},
          .sizes = {width, height, 4, 4}};
}

class VulkanTest : public testing::Test {
 protected:
  void SetUp() override {
    if (vulkan_devices().empty()) GTEST_SKIP() << "no Vulkan device on this machine";
  }
};

/// A debug backend, with the textures that a draw needs.
struct VulkanRig {
  VulkanRig() : VulkanRig(0) {}
  explicit VulkanRig(int device) : backend(open_vulkan(device, {.debug = true})) {
    const std::vector<std::byte> texels(std::size_t{4} * 4 * 4, std::byte{128});
    plain = backend->upload({.width = 4, .height = 4, .texels = texels});
  }
  [[nodiscard]] std::unique_ptr<Pipeline> pipeline(const Spirv& fragment, const Target& target,
                                                   std::vector<SpecConstant> constants = {}) const {
    return backend->compile(
        {.label = "test", .vertex = vertex, .fragment = fragment, .constants = std::move(constants), .target = target});
  }
  [[nodiscard]] Draw draw(const Pipeline& pipeline, int width, int height) const {
    return {.pipeline = &pipeline,
            .textures = {{kReliefMap, plain.get()}, {kNormalMap, plain.get()}, {kReferenceMap, plain.get()}},
            .frame = frame_of(width, height)};
  }

  std::unique_ptr<Backend> backend;
  Spirv vertex = compile_vertex(Dialect::vulkan);
  std::unique_ptr<Texture> plain;
};

TEST_F(VulkanTest, DevicesAreListedWithoutNoise) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  const auto devices = vulkan_devices();
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  for (const DeviceInfo& device : devices) {
    EXPECT_THAT(device.vendor, Not(IsEmpty()));
    EXPECT_EQ(device.software, device.type == "cpu");
    EXPECT_GE(device.subtexel_bits, 4);  // Vulkan's own minimum
  }
}

TEST(Vulkan, NamesTheFailedCallAndTheLostDevice) {
  EXPECT_NO_THROW(vk_check(VK_SUCCESS, "vkQueueSubmit"));
  EXPECT_THAT(message_of([] { vk_check(VK_ERROR_DEVICE_LOST, "vkQueueSubmit"); }),
              AllOf(HasSubstr("vkQueueSubmit"), HasSubstr("device lost")));
  EXPECT_THAT(message_of([] { vk_check(VK_TIMEOUT, "vkWaitForFences"); }), HasSubstr("vkWaitForFences"));
}

TEST(Vulkan, FaultsAreToldByTheirCodes) {
  const auto fault = [](VkResult result) {
    try {
      vk_check(result, "device lost, or so a message says");
    } catch (const Error& error) {
      return error.fault();
    }
    return Fault::other;
  };
  EXPECT_EQ(fault(VK_ERROR_DEVICE_LOST), Fault::device_lost);
  EXPECT_EQ(fault(VK_ERROR_OUT_OF_DEVICE_MEMORY), Fault::out_of_memory);
  EXPECT_EQ(fault(VK_ERROR_OUT_OF_HOST_MEMORY), Fault::out_of_memory);
  EXPECT_EQ(fault(VK_ERROR_INITIALIZATION_FAILED), Fault::other);
}

// The validation layer finds leaked objects when the device goes, after the last chance to ask debug_messages().
TEST_F(VulkanTest, ValidationHasNothingToSayFromStartToEnd) {
  testing::internal::CaptureStderr();
  for (const DeviceInfo& device : vulkan_devices()) {
    const VulkanRig rig(device.index);
    for (const Format& format : formats()) {
      if (!device.takes(format.type)) continue;
      const std::vector<std::byte> texels(level_bytes(format.relief(), 5, 3), std::byte{1});
      for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
        static_cast<void>(rig.backend->upload({.width = 5,
                                               .height = 3,
                                               .layout = format.relief(),
                                               .texels = texels,
                                               .wrap = wrap,
                                               .filter = Filter::nearest}));
      }
    }
    for (const Target& target : {Target::color, Target::score}) {
      const auto pipeline = rig.pipeline(compile_fragment("flat", target, Dialect::vulkan), target, {{99, 1}});
      for (const int side : {16, 33, 33}) {
        for (const Timer timer : device.timers) rig.backend->render(rig.draw(*pipeline, side, side), 3, timer);
        static_cast<void>(target == Target::color ? rig.backend->read_color().size()
                                                  : rig.backend->read_score().size());
      }
    }
    EXPECT_THAT(rig.backend->debug_messages(), IsEmpty());
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// Else the test above would prove nothing.
TEST_F(VulkanTest, ValidationFindsMisuseAndMissingBarriers) {
  testing::internal::CaptureStderr();
  {
    const VulkanDevice device(0, {.debug = true});
    static_cast<void>(make_host_buffer(device, 16, VK_BUFFER_USAGE_TRANSFER_DST_BIT, 0));
    EXPECT_THAT(device.instance().messages(), IsEmpty());
    const HostBuffer buffer = make_host_buffer(device, 16, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 0);
    run_once(device, [&](VkCommandBuffer commands) {
      device.calls().vkCmdFillBuffer(commands, buffer.buffer.get(), 0, 16, 0);
    });
    EXPECT_THAT(device.instance().messages(), testing::Contains(HasSubstr("VUID-vkCmdFillBuffer-dstBuffer-00029")));
    const HostBuffer target = make_host_buffer(device, 16, VK_BUFFER_USAGE_TRANSFER_DST_BIT, 0);
    run_once(device, [&](VkCommandBuffer commands) {
      for (const std::uint32_t value : {1U, 2U})
        device.calls().vkCmdFillBuffer(commands, target.buffer.get(), 0, 16, value);
    });
    EXPECT_THAT(device.instance().messages(), testing::Contains(HasSubstr("SYNC-HAZARD-WRITE-AFTER-WRITE")));
  }
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("SYNC-HAZARD-WRITE-AFTER-WRITE"));
}

// reference.glsl returns texel (x, y) as the hit of pixel (x, y): upload, rows and both attachments in one.
TEST_F(VulkanTest, ScoreFrameKeepsRowsAndBothAttachments) {
  const VulkanRig rig;
  constexpr int kWidth = 7;
  constexpr int kHeight = 5;
  std::vector<float> exact(static_cast<std::size_t>(kWidth) * kHeight);
  std::iota(exact.begin(), exact.end(), 1.0F);
  const auto reference = rig.backend->upload({.width = kWidth,
                                              .height = kHeight,
                                              .layout = find_format("r32f").relief(),
                                              .texels = std::as_bytes(std::span(exact)),
                                              .filter = Filter::nearest});
  const auto pipeline = rig.pipeline(compile_fragment("reference", Target::score, Dialect::vulkan), Target::score);
  Draw draw = rig.draw(*pipeline, kWidth, kHeight);
  draw.textures[kReferenceMap] = reference.get();
  rig.backend->render(draw, 2, Timer::fenced_wall);
  const std::vector<ScorePixel> pixels = rig.backend->read_score();
  ASSERT_EQ(pixels.size(), exact.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    EXPECT_EQ(pixels[i].t, exact[i]);
    EXPECT_EQ(pixels[i].status, static_cast<float>(PixelStatus::hit));
    EXPECT_EQ(pixels[i].taps, 1);
    // Straight down from the middle: a picture 1.2 tiles wide, u grows with x, v falls with y.
    const std::size_t row = i / kWidth;
    const float u = 0.5F + 0.6F * ((static_cast<float>(i % kWidth) + 0.5F) / kWidth * 2 - 1);
    const float v = 0.5F - 0.6F * ((static_cast<float>(row) + 0.5F) / kHeight * 2 - 1);
    EXPECT_NEAR(pixels[i].ray.u, u - std::floor(u), 1e-5);
    EXPECT_NEAR(pixels[i].ray.v, v - std::floor(v), 1e-5);
  }
  EXPECT_THAT(rig.backend->debug_messages(), IsEmpty());
}

// No iteration leaves the start value, one makes a step of the logistic map.
TEST_F(VulkanTest, SpecializationConstantSetsTheLoad) {
  const VulkanRig rig;
  for (const int steps : {0, 1}) {
    const auto pipeline = rig.pipeline(compile_load(Dialect::vulkan), Target::color, {{0, steps}});
    rig.backend->render(rig.draw(*pipeline, 3, 2), 1, Timer::fenced_wall);
    const std::vector<std::uint8_t> color = rig.backend->read_color();
    ASSERT_EQ(color.size(), 3U * 2U * 4U);
    for (int i = 0; i < 6; ++i) {
      const int row = i / 3;
      const double start = (0.0137 * (i % 3 + 0.5) + 0.0071 * (row + 0.5)) * 0.8 + 0.1;
      const double value = steps == 0 ? start : 3.9 * start * (1 - start);
      EXPECT_NEAR(color[static_cast<std::size_t>(4 * i)], 255 * value, 1) << i;
      EXPECT_EQ(color[static_cast<std::size_t>(4 * i + 3)], 255);
    }
  }
}

// One command buffer, several, and several with a rest.
TEST_F(VulkanTest, BatchesOfAnyLengthAreTimed) {
  const VulkanRig rig;
  const auto pipeline = rig.pipeline(compile_load(Dialect::vulkan), Target::color);
  for (const int frames : {1, 63, 64, 65, 1000}) {
    for (const Timer timer : rig.backend->device().timers) {
      const BatchTime time = rig.backend->render(rig.draw(*pipeline, 32, 32), frames, timer);
      EXPECT_GT(time.wall_ns, 0);
      EXPECT_EQ(time.device_ns.has_value(), timer == Timer::vk_timestamp);
      if (time.device_ns) {
        EXPECT_GT(*time.device_ns, 0);
      }
    }
  }
  EXPECT_THAT(rig.backend->debug_messages(), IsEmpty());
}

TEST_F(VulkanTest, MisuseIsAnErrorNotACrash) {
  const VulkanRig rig;
  const auto pipeline = rig.pipeline(compile_fragment("reference", Target::color, Dialect::vulkan), Target::color);
  Draw draw = rig.draw(*pipeline, 4, 4);
  EXPECT_THAT(message_of([&] { static_cast<void>(rig.backend->read_score()); }), HasSubstr("attachment out_ray"));
  EXPECT_THAT(message_of([&] { rig.backend->render(draw, 1, Timer::gl_timestamp); }), HasSubstr("gl_timestamp"));
  EXPECT_THAT(message_of([&] { rig.backend->render(draw, 0, Timer::fenced_wall); }), HasSubstr("0 frames"));
  const Texture foreign;
  for (const Texture* texture : {static_cast<const Texture*>(nullptr), &foreign}) {
    draw.textures[kNormalMap] = texture;
    EXPECT_THAT(message_of([&] { rig.backend->render(draw, 1, Timer::fenced_wall); }), HasSubstr(kNormalMap));
  }
  const std::vector<std::byte> texels(1 << 20);
  EXPECT_THAT(message_of([&] {
                static_cast<void>(rig.backend->upload({.width = 1 << 20,
                                                       .height = 1,
                                                       .layout = find_format("r8").relief(),
                                                       .texels = texels,
                                                       .filter = Filter::nearest}));
              }),
              HasSubstr("1048576x1"));
  EXPECT_THAT(message_of([&] { static_cast<void>(rig.backend->upload({.width = 3, .height = 3, .texels = texels})); }),
              HasSubstr("3x3"));
  EXPECT_THAT(rig.backend->debug_messages(), IsEmpty());
}

TEST_F(VulkanTest, MissingValidationLayerIsAnEnvironmentError) {
  const ScopedVariable no_layers("VK_LAYER_PATH", "/nonexistent");
  EXPECT_THAT(message_of([] { static_cast<void>(open_vulkan(0, {.debug = true})); }),
              HasSubstr("VK_LAYER_KHRONOS_validation"));
  EXPECT_NO_THROW(static_cast<void>(open_vulkan(0, {.debug = false})));
}

TEST(Vulkan, WithoutADriverThereAreNoDevices) {
  const ScopedVariable no_drivers("VK_ICD_FILENAMES", "/nonexistent.json");
  EXPECT_THAT(vulkan_devices(), IsEmpty());
  EXPECT_THAT(message_of([] { static_cast<void>(open_vulkan(0, {})); }), HasSubstr("vulkan"));
}

TEST_F(VulkanTest, UnknownDeviceNamesHowManyThereAre) {
  const int count = static_cast<int>(vulkan_devices().size());
  for (const int index : {-1, count}) {
    EXPECT_THAT(message_of([index] { static_cast<void>(open_vulkan(index, {})); }),
                AllOf(HasSubstr(std::to_string(index)), HasSubstr(fmt::format("there are {}", count))));
  }
}

// volk's global pointers are those of the last instance; each device here must keep to its own.
TEST_F(VulkanTest, OpenDevicesDoNotDisturbEachOther) {
  auto debug = std::make_unique<VulkanRig>();
  const auto plain = open_vulkan(0, {.debug = false});
  const auto pipeline = debug->pipeline(compile_load(Dialect::vulkan), Target::color);
  debug->backend->render(debug->draw(*pipeline, 4, 4), 1, Timer::fenced_wall);
  EXPECT_EQ(debug->backend->read_color().size(), 64U);
  EXPECT_EQ(plain->device().name, debug->backend->device().name);
  EXPECT_THAT(plain->debug_messages(), IsEmpty());
}

}  // namespace
}  // namespace reliefbench
