#include <array>
#include <cstring>
#include <optional>

#include "backends/backend.h"
#include "backends/vulkan/vulkan_compute.h"
#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"
#include "backends/vulkan/vulkan_pipeline.h"
#include "backends/vulkan/vulkan_texture.h"
#include "backends/vulkan/vulkan_timestamps.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

// Batches of thousands of frames replay one command buffer: recording stays short and its memory bounded.
constexpr int kFramesPerBuffer = 64;

/// The image or images that a pipeline draws into.
struct FrameTarget {
  std::vector<DeviceImage> images;
  Owned<VkFramebuffer, &VolkDeviceTable::vkDestroyFramebuffer> framebuffer;
  VkExtent2D extent{};
};

FrameTarget make_target(const VulkanDevice& device, VkRenderPass pass, Target kind, VkExtent2D extent) {
  FrameTarget target{.images = {}, .framebuffer = {}, .extent = extent};
  std::vector<VkImageView> views;
  for (const VkFormat format : attachment_formats(kind)) {
    target.images.push_back(make_device_image(
        device, {.extent = extent,
                 .format = format,
                 .format_id = kind == Target::score ? "rgba32f" : "rgba8",
                 .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                 .features = VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT}));
    views.push_back(target.images.back().view.get());
  }
  const VkFramebufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                                     .renderPass = pass,
                                     .attachmentCount = static_cast<std::uint32_t>(views.size()),
                                     .pAttachments = views.data(),
                                     .width = extent.width,
                                     .height = extent.height,
                                     .layers = 1};
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateFramebuffer(device.handle(), &info, nullptr, &framebuffer), "vkCreateFramebuffer");
  target.framebuffer = {device.logical(), framebuffer};
  run_once(device, [&](VkCommandBuffer commands) {
    for (const DeviceImage& image : target.images) transition(device, commands, image, kUnused, kDrawn);
  });
  return target;
}

/// An object of this backend, out of the interface's pointer.
template <typename Mine, typename Base>
const Mine& own(const Base* object, std::string_view what) {
  const auto* mine = dynamic_cast<const Mine*>(object);
  if (mine == nullptr) fail_environment("vulkan: the {} is missing or of another backend", what);
  return *mine;
}

class VulkanBackend final : public Backend {
 public:
  VulkanBackend(int device_index, const BackendOptions& options)
      : device_(device_index, options),
        info_(device_info(device_.physical(), device_index)),
        layouts_(device_),
        bindings_(device_, layouts_.descriptors()),
        stamps_(device_) {}

  [[nodiscard]] const DeviceInfo& device() const override { return info_; }
  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    return make_texture(device_, desc);
  }
  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    return make_pipeline(device_, layouts_, desc);
  }
  BatchTime render(const Draw& draw, int frames, Timer timer) override;
  [[nodiscard]] std::vector<ScorePixel> read_score() override;
  [[nodiscard]] std::vector<std::uint8_t> read_color() override;
  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    return std::make_unique<VulkanCompute>(device_, desc);
  }
  [[nodiscard]] std::vector<std::byte> compute(const ComputeJob& job) override {
    return own<VulkanCompute>(job.pipeline, "compute pipeline").run(job);
  }
  [[nodiscard]] std::vector<std::string> debug_messages() const override { return device_.instance().messages(); }

 private:
  std::optional<FrameTarget>& slot(Target kind) { return targets_[static_cast<std::size_t>(kind)]; }
  const FrameTarget& prepare_target(Target kind, const FrameUniforms& frame);
  const FrameTarget& drawn_target(Target kind);
  void record_frames(VkCommandBuffer commands, const VulkanPipeline& pipeline, const FrameTarget& target, int frames);

  VulkanDevice device_;
  DeviceInfo info_;
  PipelineLayouts layouts_;
  Bindings bindings_;
  Timestamps stamps_;
  std::array<std::optional<FrameTarget>, 2> targets_;  ///< by Target
};

const FrameTarget& VulkanBackend::prepare_target(Target kind, const FrameUniforms& frame) {
  if (frame.sizes[0] < 1 || frame.sizes[1] < 1) {
    fail_environment("vulkan: no frame of {}x{} pixels", frame.sizes[0], frame.sizes[1]);
  }
  const VkExtent2D extent{.width = static_cast<std::uint32_t>(frame.sizes[0]),
                          .height = static_cast<std::uint32_t>(frame.sizes[1])};
  std::optional<FrameTarget>& target = slot(kind);
  if (!target || target->extent.width != extent.width || target->extent.height != extent.height) {
    target.reset();  // before the new one is made, so that both never take memory at once
    target = make_target(device_, layouts_.render_pass(kind), kind, extent);
  }
  return *target;
}

const FrameTarget& VulkanBackend::drawn_target(Target kind) {
  if (!slot(kind)) fail_environment("vulkan: no {} frame was drawn", kind == Target::score ? "score" : "color");
  return *slot(kind);
}

void VulkanBackend::record_frames(VkCommandBuffer commands, const VulkanPipeline& pipeline, const FrameTarget& target,
                                  int frames) {
  const VolkDeviceTable& vk = device_.calls();
  const VkRect2D area{.extent = target.extent};
  const VkViewport viewport{.width = static_cast<float>(target.extent.width),
                            .height = static_cast<float>(target.extent.height),
                            .maxDepth = 1};
  const VkDescriptorSet set = bindings_.set();
  vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.handle.get());
  vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layouts_.pipeline(), 0, 1, &set, 0, nullptr);
  vk.vkCmdSetViewport(commands, 0, 1, &viewport);
  vk.vkCmdSetScissor(commands, 0, 1, &area);
  const VkRenderPassBeginInfo pass{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                   .renderPass = layouts_.render_pass(pipeline.target),
                                   .framebuffer = target.framebuffer.get(),
                                   .renderArea = area};
  for (int i = 0; i < frames; ++i) {
    vk.vkCmdBeginRenderPass(commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
    vk.vkCmdDraw(commands, 3, 1, 0, 0);
    vk.vkCmdEndRenderPass(commands);
  }
}

BatchTime VulkanBackend::render(const Draw& draw, int frames, Timer timer) {
  const bool stamped = timer == Timer::vk_timestamp && stamps_.available();
  if (timer != Timer::fenced_wall && !stamped) {
    fail_environment("vulkan: this device has no timer {}", timer_id(timer));
  }
  if (frames < 1) fail_environment("vulkan: a batch of {} frames", frames);
  const auto& pipeline = own<VulkanPipeline>(draw.pipeline, "pipeline");
  const FrameTarget& target = prepare_target(pipeline.target, draw.frame);
  bindings_.write(draw.frame,
                  {&own<VulkanTexture>(draw.relief, "relief"), &own<VulkanTexture>(draw.normals, "normals"),
                   &own<VulkanTexture>(draw.reference, "reference"), &own<VulkanTexture>(draw.extra, "extra texture")});

  const VkCommandBufferUsageFlags replayed = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;
  const Commands before(device_, 0);
  const Commands many(device_, replayed);
  const Commands rest(device_, 0);
  const Commands after(device_, 0);
  if (stamped) stamps_.record_start(before.handle());
  if (frames >= kFramesPerBuffer) record_frames(many.handle(), pipeline, target, kFramesPerBuffer);
  record_frames(rest.handle(), pipeline, target, frames % kFramesPerBuffer);
  if (stamped) stamps_.record_end(after.handle());

  std::vector<VkCommandBuffer> batch{before.end()};
  batch.insert(batch.end(), static_cast<std::size_t>(frames / kFramesPerBuffer), many.end());
  batch.push_back(rest.end());
  batch.push_back(after.end());
  BatchTime time{.wall_ns = device_.run(batch)};
  if (stamped) time.device_ns = stamps_.elapsed_ns();
  return time;
}

std::vector<ScorePixel> VulkanBackend::read_score() {
  const FrameTarget& target = drawn_target(Target::score);
  constexpr std::size_t kHalf = sizeof(ScorePixel) / 2;  // of a pixel, in each attachment
  const HostBuffer first = read_texels(device_, target.images[0], kHalf);
  const HostBuffer second = read_texels(device_, target.images[1], kHalf);
  std::vector<ScorePixel> pixels(first.bytes.size() / kHalf);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::array<std::byte, sizeof(ScorePixel)> pixel{};
    std::memcpy(pixel.data(), first.bytes.data() + i * kHalf, kHalf);
    std::memcpy(pixel.data() + kHalf, second.bytes.data() + i * kHalf, kHalf);
    std::memcpy(&pixels[i], pixel.data(), pixel.size());
  }
  return pixels;
}

std::vector<std::uint8_t> VulkanBackend::read_color() {
  const HostBuffer texels = read_texels(device_, drawn_target(Target::color).images[0], 4);
  std::vector<std::uint8_t> color(texels.bytes.size());
  std::memcpy(color.data(), texels.bytes.data(), color.size());
  return color;
}

}  // namespace

std::vector<DeviceInfo> vulkan_devices() {
  std::vector<DeviceInfo> infos;
  try {
    const VulkanInstance instance(false);
    for (const PhysicalDevice& physical : physical_devices(instance)) {
      infos.push_back(device_info(physical, static_cast<int>(infos.size())));
    }
  } catch (const Error&) {
    infos.clear();  // no Vulkan here is an answer, not a failure
  }
  return infos;
}

std::unique_ptr<Backend> open_vulkan(int device_index, const BackendOptions& options) {
  return std::make_unique<VulkanBackend>(device_index, options);
}

}  // namespace reliefbench
