#include <mutex>

#include "backends/backend.h"
#include "backends/vulkan/vulkan_backend.h"
#include "backends/vulkan/vulkan_bindings.h"
#include "backends/vulkan/vulkan_compute.h"
#include "backends/vulkan/vulkan_compute_job.h"
#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"
#include "backends/vulkan/vulkan_pipeline.h"
#include "backends/vulkan/vulkan_target.h"
#include "backends/vulkan/vulkan_texture.h"
#include "backends/vulkan/vulkan_timestamps.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

// Batches of thousands of frames replay one command buffer: recording stays short and its memory bounded.
constexpr int kFramesPerBuffer = 64;

class VulkanBackend final : public Backend {
 public:
  VulkanBackend(int device_index, const BackendOptions& options, WindowExtensions window = {})
      : device_(device_index, options, window),
        info_(device_info(device_.physical(), device_index)),
        targets_(device_),
        bindings_(device_),
        stamps_(device_) {}

  [[nodiscard]] const DeviceInfo& device() const override { return info_; }
  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    return make_texture(device_, desc);
  }
  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    const auto pass = [&] {
      const std::lock_guard lock(targets_mutex_);
      return targets_.render_pass(desc.target);
    };
    return make_pipeline(device_, pass(), desc);
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override;
  [[nodiscard]] std::span<const std::uint8_t> read(std::string_view attachment) override;
  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    return std::make_unique<VulkanCompute>(device_, desc);
  }
  [[nodiscard]] ComputeResult compute(const ComputeJob& job) override {
    for (const ComputePass& pass : job.passes) (void)own<VulkanCompute>(pass.pipeline, "compute pipeline");
    return VulkanComputeJob(device_, job).run();
  }
  [[nodiscard]] std::vector<std::string> debug_messages() const override { return device_.instance().messages(); }

  [[nodiscard]] const VulkanDevice& vulkan_device() const { return device_; }
  [[nodiscard]] const DeviceImage& drawn_color() const {
    const auto drawn = targets_.drawn(Target::color.attachments.front().name);
    if (!drawn) fail_not_drawn("vulkan", Target::color.attachments.front().name);
    return drawn->image;
  }

 private:
  const VulkanTarget& prepare_target(std::span<const Draw> frame);
  void record_frames(VkCommandBuffer commands, std::span<const Draw> frame, const VulkanTarget& target, int frames);
  void record_dispatches(VkCommandBuffer commands, std::span<const Draw> frame, int frames);
  void record_bound(VkCommandBuffer commands, const Draw& draw, std::size_t index);

  VulkanDevice device_;
  DeviceInfo info_;
  FrameTargets targets_;
  std::mutex targets_mutex_;  ///< compile() is called on several threads
  Bindings bindings_;
  Timestamps stamps_;
  HostBuffer read_{};
};

const VulkanTarget& VulkanBackend::prepare_target(std::span<const Draw> frame) {
  const auto& sizes = frame.front().frame.sizes;
  if (sizes[0] < 1 || sizes[1] < 1) fail_environment("vulkan: no frame of {}x{} pixels", sizes[0], sizes[1]);
  const Target& target = own<VulkanPipeline>(frame.front().pipeline, "pipeline").target;
  for (const Draw& draw : frame)
    if (own<VulkanPipeline>(draw.pipeline, "pipeline").target != target)
      fail_environment("vulkan: the draws of a frame go into different targets");
  return targets_.prepare(
      target, {.width = static_cast<std::uint32_t>(sizes[0]), .height = static_cast<std::uint32_t>(sizes[1])});
}

/// Records a draw's pipeline and descriptors. index: of the draw in its frame
void VulkanBackend::record_bound(VkCommandBuffer commands, const Draw& draw, std::size_t index) {
  const VolkDeviceTable& vk = device_.calls();
  const auto& pipeline = own<VulkanPipeline>(draw.pipeline, "pipeline");
  const VkPipelineBindPoint point =
      pipeline.target.by_compute ? VK_PIPELINE_BIND_POINT_COMPUTE : VK_PIPELINE_BIND_POINT_GRAPHICS;
  vk.vkCmdBindPipeline(commands, point, pipeline.handle.get());
  const VkDescriptorSet set = bindings_.set(index);
  if (set != VK_NULL_HANDLE) vk.vkCmdBindDescriptorSets(commands, point, pipeline.layout.get(), 0, 1, &set, 0, nullptr);
}

/// Each dispatch waits until the one before has put its pixels.
void VulkanBackend::record_dispatches(VkCommandBuffer commands, std::span<const Draw> frame, int frames) {
  const VolkDeviceTable& vk = device_.calls();
  const VkMemoryBarrier one_before{
      .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = kStored.access, .dstAccessMask = kStored.access};
  if (frame.size() == 1) record_bound(commands, frame.front(), 0);  // a lone one stays bound
  for (int i = 0; i < frames; ++i)
    for (std::size_t draw = 0; draw < frame.size(); ++draw) {
      if (frame.size() > 1) record_bound(commands, frame[draw], draw);
      vk.vkCmdPipelineBarrier(commands, kStored.stage, kStored.stage, 0, 1, &one_before, 0, nullptr, 0, nullptr);
      const auto [columns, rows] =
          groups_of(own<VulkanPipeline>(frame[draw].pipeline, "pipeline").shader, frame[draw].frame);
      vk.vkCmdDispatch(commands, columns, rows, 1);
    }
}

void VulkanBackend::record_frames(VkCommandBuffer commands, std::span<const Draw> frame, const VulkanTarget& target,
                                  int frames) {
  if (target.target.by_compute) return record_dispatches(commands, frame, frames);
  const VolkDeviceTable& vk = device_.calls();
  const VkRect2D area{.extent = target.extent};
  const VkViewport viewport{.width = static_cast<float>(target.extent.width),
                            .height = static_cast<float>(target.extent.height),
                            .maxDepth = 1};
  vk.vkCmdSetViewport(commands, 0, 1, &viewport);
  vk.vkCmdSetScissor(commands, 0, 1, &area);
  std::vector<VkClearValue> clear(target.images.size());  // black
  if (target.target.has_depth) clear.back().depthStencil = {.depth = 1};
  const VkRenderPassBeginInfo pass{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                   .renderPass = target.pass.get(),
                                   .framebuffer = target.framebuffer.get(),
                                   .renderArea = area,
                                   .clearValueCount = static_cast<std::uint32_t>(clear.size()),
                                   .pClearValues = clear.data()};
  if (frame.size() == 1) record_bound(commands, frame.front(), 0);  // a lone draw stays bound
  for (int i = 0; i < frames; ++i) {
    vk.vkCmdBeginRenderPass(commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
    for (std::size_t draw = 0; draw < frame.size(); ++draw) {
      if (frame.size() > 1) record_bound(commands, frame[draw], draw);
      vk.vkCmdDraw(commands, static_cast<std::uint32_t>(frame[draw].vertices), 1, 0, 0);
    }
    vk.vkCmdEndRenderPass(commands);
  }
}

BatchTime VulkanBackend::render(std::span<const Draw> frame, int frames, Timer timer) {
  const bool stamped = timer == Timer::vk_timestamp && stamps_.available();
  if (timer != Timer::fenced_wall && !stamped) {
    fail_environment("vulkan: this device has no timer {}", timer_id(timer));
  }
  if (frame.empty() || frames < 1) fail_environment("vulkan: a batch of {} frames of {} draws", frames, frame.size());
  const VulkanTarget& target = prepare_target(frame);
  bindings_.write(frame, target);

  const VkCommandBufferUsageFlags replayed = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;
  const Commands before(device_, 0);
  const Commands many(device_, replayed);
  const Commands rest(device_, 0);
  const Commands after(device_, 0);
  if (stamped) stamps_.record_start(before.handle());
  if (frames >= kFramesPerBuffer) record_frames(many.handle(), frame, target, kFramesPerBuffer);
  record_frames(rest.handle(), frame, target, frames % kFramesPerBuffer);
  if (stamped) stamps_.record_end(after.handle());

  std::vector<VkCommandBuffer> batch{before.end()};
  batch.insert(batch.end(), static_cast<std::size_t>(frames / kFramesPerBuffer), many.end());
  batch.push_back(rest.end());
  batch.push_back(after.end());
  BatchTime time;
  time.wall_ns = device_.run(batch);
  if (stamped) time.device_ns = stamps_.elapsed_ns();
  return time;
}

std::span<const std::uint8_t> VulkanBackend::read(std::string_view attachment) {
  const auto drawn = targets_.drawn(attachment);
  if (!drawn) fail_not_drawn("vulkan", attachment);
  const std::span<const std::byte> texels = read_texels(device_, drawn->image, drawn->texel_bytes, read_);
  return {reinterpret_cast<const std::uint8_t*>(texels.data()), texels.size()};
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

std::unique_ptr<Backend> open_vulkan_for_window(int device_index, const BackendOptions& options,
                                                WindowExtensions window) {
  return std::make_unique<VulkanBackend>(device_index, options, window);
}

const VulkanDevice& vulkan_device_of(const Backend& backend) {
  return dynamic_cast<const VulkanBackend&>(backend).vulkan_device();
}

const DeviceImage& image_in_window(const Backend& backend) {
  return dynamic_cast<const VulkanBackend&>(backend).drawn_color();
}

std::unique_ptr<Backend> open_vulkan(int device_index, const BackendOptions& options) {
  return std::make_unique<VulkanBackend>(device_index, options);
}

}  // namespace reliefbench
