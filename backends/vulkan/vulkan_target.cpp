#include "backends/vulkan/vulkan_target.h"

#include <algorithm>

#include "backends/vulkan/vulkan_texture.h"

namespace reliefbench {
namespace {

constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;  // that every device can draw into

/// An attachment of a render pass. The layout never changes between frames.
VkAttachmentDescription attachment(VkFormat format, bool is_cleared, VkImageLayout layout) {
  return {.format = format,
          .samples = VK_SAMPLE_COUNT_1_BIT,
          .loadOp = is_cleared ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_DONT_CARE,
          .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
          .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
          .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
          .initialLayout = layout,
          .finalLayout = layout};
}

VkRenderPass make_render_pass(const VulkanDevice& device, const Target& target) {
  std::vector<VkAttachmentDescription> attachments;
  std::vector<VkAttachmentReference> colors;
  for (const Attachment& color : target.attachments) {
    colors.push_back({.attachment = static_cast<std::uint32_t>(attachments.size()), .layout = kDrawn.layout});
    attachments.push_back(attachment(vulkan_format(color.layout), target.has_depth, kDrawn.layout));
  }
  const VkAttachmentReference depth{.attachment = static_cast<std::uint32_t>(attachments.size()),
                                    .layout = kDrawnDepth.layout};
  if (target.has_depth) attachments.push_back(attachment(kDepthFormat, true, kDrawnDepth.layout));
  const VkSubpassDescription subpass{.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS,
                                     .colorAttachmentCount = static_cast<std::uint32_t>(colors.size()),
                                     .pColorAttachments = colors.data(),
                                     .pDepthStencilAttachment = target.has_depth ? &depth : nullptr};
  // The barrier between frames: each waits until the one before has left the attachments.
  const VkPipelineStageFlags stages = kDrawn.stage | (target.has_depth ? kDrawnDepth.stage : 0);
  const VkAccessFlags accesses = kDrawn.access | (target.has_depth ? kDrawnDepth.access : 0);
  const VkSubpassDependency frame_before{.srcSubpass = VK_SUBPASS_EXTERNAL,
                                         .dstSubpass = 0,
                                         .srcStageMask = stages,
                                         .dstStageMask = stages,
                                         .srcAccessMask = accesses,
                                         .dstAccessMask = accesses};
  const VkRenderPassCreateInfo info{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO,
                                    .attachmentCount = static_cast<std::uint32_t>(attachments.size()),
                                    .pAttachments = attachments.data(),
                                    .subpassCount = 1,
                                    .pSubpasses = &subpass,
                                    .dependencyCount = 1,
                                    .pDependencies = &frame_before};
  VkRenderPass pass = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateRenderPass(device.handle(), &info, nullptr, &pass), "vkCreateRenderPass");
  return pass;
}

/// One that may be drawn into is no storage image: that may cost it its compression.
DeviceImage make_color(const VulkanDevice& device, const TexelLayout& layout, VkExtent2D extent, bool by_compute) {
  const std::string format_id = fmt::format("{} x {}", layout.channels, texel_type_id(layout.type));
  const VkImageUsageFlags usage = by_compute ? VK_IMAGE_USAGE_STORAGE_BIT : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  const VkFormatFeatureFlags feature =
      by_compute ? VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT : VK_FORMAT_FEATURE_COLOR_ATTACHMENT_BIT;
  return make_device_image(device, {.extent = extent,
                                    .format = vulkan_format(layout),
                                    .format_id = format_id,
                                    .texel_bytes = static_cast<std::size_t>(layout.bytes()),
                                    .usage = usage | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                                    .features = feature | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT,
                                    .rest = by_compute ? kStored : kDrawn});
}

DeviceImage make_depth(const VulkanDevice& device, VkExtent2D extent) {
  return make_device_image(
      device, {.extent = extent,
               .format = kDepthFormat,
               .format_id = "depth",
               .texel_bytes = static_cast<std::size_t>(kDepth.layout.bytes()),
               .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
               .features = VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_FORMAT_FEATURE_TRANSFER_SRC_BIT,
               .aspect = VK_IMAGE_ASPECT_DEPTH_BIT,
               .rest = kDrawnDepth});
}

VkFramebuffer make_framebuffer(const VulkanDevice& device, VkRenderPass pass, std::span<const DeviceImage> images,
                               VkExtent2D extent) {
  std::vector<VkImageView> views;
  views.reserve(images.size());
  for (const DeviceImage& image : images) views.push_back(image.view.get());
  const VkFramebufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                                     .renderPass = pass,
                                     .attachmentCount = static_cast<std::uint32_t>(views.size()),
                                     .pAttachments = views.data(),
                                     .width = extent.width,
                                     .height = extent.height,
                                     .layers = 1};
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateFramebuffer(device.handle(), &info, nullptr, &framebuffer), "vkCreateFramebuffer");
  return framebuffer;
}

}  // namespace

VulkanTarget& FrameTargets::find(const Target& target) {
  const auto found = std::ranges::find(targets_, target, &VulkanTarget::target);
  if (found != targets_.end()) return *found;
  VulkanTarget& made = targets_.emplace_back(VulkanTarget{.target = target});
  if (!target.by_compute) made.pass = {device_.logical(), make_render_pass(device_, target)};
  return made;
}

const VulkanTarget& FrameTargets::prepare(const Target& target, VkExtent2D extent) {
  VulkanTarget& frame = find(target);
  targets_.splice(targets_.begin(), targets_, std::ranges::find(targets_, target, &VulkanTarget::target));
  if (!frame.images.empty() && frame.extent.width == extent.width && frame.extent.height == extent.height) return frame;

  // The old images go first, so that both never take memory at once.
  frame.framebuffer = {};
  frame.images.clear();
  std::vector<DeviceImage> images;
  images.reserve(target.attachments.size() + 1);
  for (const Attachment& color : target.attachments)
    images.push_back(make_color(device_, color.layout, extent, target.by_compute));
  if (target.has_depth) images.push_back(make_depth(device_, extent));
  if (!target.by_compute)
    frame.framebuffer = {device_.logical(), make_framebuffer(device_, frame.pass.get(), images, extent)};
  run_once(device_, [&](VkCommandBuffer commands) {
    for (const DeviceImage& image : images) transition(device_, commands, image, kUnused, image.rest);
  });
  frame.images = std::move(images);
  frame.extent = extent;
  return frame;
}

std::optional<FrameTargets::Drawn> FrameTargets::drawn(std::string_view attachment) const {
  for (const VulkanTarget& frame : targets_) {
    const std::vector<Attachment>& colors = frame.target.attachments;
    for (std::size_t i = 0; i < frame.images.size(); ++i) {
      const Attachment& here = i < colors.size() ? colors[i] : kDepth;
      if (here.name == attachment)
        return Drawn{.image = frame.images[i], .texel_bytes = static_cast<std::size_t>(here.layout.bytes())};
    }
  }
  return std::nullopt;
}

}  // namespace reliefbench
