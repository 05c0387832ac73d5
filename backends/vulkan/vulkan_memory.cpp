#include "backends/vulkan/vulkan_memory.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::optional<std::uint32_t> memory_type(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                         VkMemoryPropertyFlags wanted) {
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    const bool has_all = (memory.memoryTypes[i].propertyFlags & wanted) == wanted;
    if ((allowed >> i & 1U) != 0 && has_all) return i;
  }
  return std::nullopt;
}

Owned<VkDeviceMemory, &VolkDeviceTable::vkFreeMemory> allocate(const VulkanDevice& device,
                                                               const VkMemoryRequirements& needs,
                                                               VkMemoryPropertyFlags required,
                                                               VkMemoryPropertyFlags preferred) {
  VkPhysicalDeviceMemoryProperties properties;
  vkGetPhysicalDeviceMemoryProperties(device.physical().handle, &properties);
  auto type = memory_type(properties, needs.memoryTypeBits, required | preferred);
  if (!type) type = memory_type(properties, needs.memoryTypeBits, required);
  if (!type) fail_environment("vulkan: the device has no memory of the kind needed (flags {:#x})", required);
  const VkDeviceSize heap = properties.memoryHeaps[properties.memoryTypes[*type].heapIndex].size;
  // Asking for more than there can ever be is against the specification.
  if (needs.size > heap)
    fail_device(Fault::out_of_memory, "vulkan: {} bytes of memory, where the device has {}", needs.size, heap);
  const VkMemoryAllocateInfo info{
      .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs.size, .memoryTypeIndex = *type};
  VkDeviceMemory memory = VK_NULL_HANDLE;
  vk_check(device.calls().vkAllocateMemory(device.handle(), &info, nullptr, &memory), "vkAllocateMemory");
  return {device.logical(), memory};
}

DeviceBuffer make_buffer(const VulkanDevice& device, std::size_t size, VkBufferUsageFlags usage,
                         VkMemoryPropertyFlags required, VkMemoryPropertyFlags preferred) {
  const VolkDeviceTable& vk = device.calls();
  const VkBufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = usage};
  VkBuffer handle = VK_NULL_HANDLE;
  vk_check(vk.vkCreateBuffer(device.handle(), &info, nullptr, &handle), "vkCreateBuffer");
  DeviceBuffer bound{.memory = {}, .buffer = {device.logical(), handle}};
  VkMemoryRequirements needs;
  vk.vkGetBufferMemoryRequirements(device.handle(), handle, &needs);
  bound.memory = allocate(device, needs, required, preferred);
  vk_check(vk.vkBindBufferMemory(device.handle(), handle, bound.memory.get(), 0), "vkBindBufferMemory");
  return bound;
}

VkBufferImageCopy whole_image(VkExtent2D extent, VkImageAspectFlags aspect) {
  return {.imageSubresource = {.aspectMask = aspect, .layerCount = 1},
          .imageExtent = {.width = extent.width, .height = extent.height, .depth = 1}};
}

/// Copies of tightly packed levels that lie one after the other.
std::vector<VkBufferImageCopy> all_levels(const DeviceImage& image, const TexelLayout& layout) {
  std::vector<VkBufferImageCopy> regions;
  std::size_t offset = 0;
  for (std::uint32_t level = 0; level < image.levels; ++level) {
    const VkExtent2D extent{.width = std::max(image.extent.width >> level, 1U),
                            .height = std::max(image.extent.height >> level, 1U)};
    regions.push_back(whole_image(extent, image.aspect));
    regions.back().imageSubresource.mipLevel = level;
    regions.back().bufferOffset = offset;
    offset += level_bytes(layout, static_cast<int>(extent.width), static_cast<int>(extent.height));
  }
  return regions;
}

void check_supported(const VulkanDevice& device, const DeviceImageDesc& desc) {
  VkFormatProperties properties;
  vkGetPhysicalDeviceFormatProperties(device.physical().handle, desc.format, &properties);
  const VkFormatFeatureFlags missing = desc.features & ~properties.optimalTilingFeatures;
  if (missing == VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT) {
    fail_environment("vulkan: the device cannot filter {} textures linearly", desc.format_id);
  }
  if (missing != 0) {
    fail_environment("vulkan: the device does not support format {}: it lacks features {:#x}", desc.format_id, missing);
  }
  const auto [width, height] = desc.extent;
  const std::uint32_t limit = device.physical().properties.limits.maxImageDimension2D;
  if (width == 0 || height == 0 || width > limit || height > limit) {
    fail_environment("vulkan: no image of {}x{}: the device takes sides of 1 to {}", width, height, limit);
  }
  VkImageFormatProperties image{};
  vk_check(vkGetPhysicalDeviceImageFormatProperties(device.physical().handle, desc.format, VK_IMAGE_TYPE_2D,
                                                    VK_IMAGE_TILING_OPTIMAL, desc.usage, 0, &image),
           "vkGetPhysicalDeviceImageFormatProperties");
  const VkDeviceSize bytes = VkDeviceSize{width} * height * desc.texel_bytes;
  if (bytes > image.maxResourceSize)
    fail_device(Fault::out_of_memory, "vulkan: an image of {} bytes, where the device takes {}", bytes,
                image.maxResourceSize);
}

}  // namespace

HostBuffer make_host_buffer(const VulkanDevice& device, std::size_t size, VkBufferUsageFlags usage,
                            VkMemoryPropertyFlags preferred) {
  DeviceBuffer bound = make_buffer(
      device, size, usage, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, preferred);
  void* mapped = nullptr;
  vk_check(device.calls().vkMapMemory(device.handle(), bound.memory.get(), 0, VK_WHOLE_SIZE, 0, &mapped),
           "vkMapMemory");
  return {.memory = std::move(bound.memory),
          .buffer = std::move(bound.buffer),
          .bytes = {static_cast<std::byte*>(mapped), size}};
}

DeviceBuffer make_device_buffer(const VulkanDevice& device, std::size_t size, VkBufferUsageFlags usage) {
  return make_buffer(device, size, usage, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0);
}

DeviceImage make_device_image(const VulkanDevice& device, const DeviceImageDesc& desc) {
  check_supported(device, desc);
  const VolkDeviceTable& vk = device.calls();
  const VkImageCreateInfo info{.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                               .imageType = VK_IMAGE_TYPE_2D,
                               .format = desc.format,
                               .extent = {.width = desc.extent.width, .height = desc.extent.height, .depth = 1},
                               .mipLevels = desc.levels,
                               .arrayLayers = 1,
                               .samples = VK_SAMPLE_COUNT_1_BIT,
                               .tiling = VK_IMAGE_TILING_OPTIMAL,
                               .usage = desc.usage};
  VkImage handle = VK_NULL_HANDLE;
  vk_check(vk.vkCreateImage(device.handle(), &info, nullptr, &handle), "vkCreateImage");
  DeviceImage image{.memory = {},
                    .image = {device.logical(), handle},
                    .view = {},
                    .extent = desc.extent,
                    .levels = desc.levels,
                    .aspect = desc.aspect,
                    .rest = desc.rest};
  VkMemoryRequirements needs;
  vk.vkGetImageMemoryRequirements(device.handle(), handle, &needs);
  image.memory = allocate(device, needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0);
  vk_check(vk.vkBindImageMemory(device.handle(), handle, image.memory.get(), 0), "vkBindImageMemory");
  image.view = make_view(device, ref_of(image), desc.format);
  return image;
}

ImageRef ref_of(const DeviceImage& image) {
  return {.image = image.image.get(), .extent = image.extent, .aspect = image.aspect, .levels = image.levels};
}

ImageView make_view(const VulkanDevice& device, const ImageRef& image, VkFormat format) {
  const bool has_ratio_in_alpha = format == VK_FORMAT_ASTC_4x4_UNORM_BLOCK;
  const VkImageViewCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
      .image = image.image,
      .viewType = VK_IMAGE_VIEW_TYPE_2D,
      .format = format,
      .components = {.g = has_ratio_in_alpha ? VK_COMPONENT_SWIZZLE_A : VK_COMPONENT_SWIZZLE_IDENTITY},
      .subresourceRange = {.aspectMask = image.aspect, .levelCount = image.levels, .layerCount = 1}};
  VkImageView view = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateImageView(device.handle(), &info, nullptr, &view), "vkCreateImageView");
  return {device.logical(), view};
}

void transition(const VulkanDevice& device, VkCommandBuffer commands, const ImageRef& image, const ImageUse& from,
                const ImageUse& to) {
  const VkImageMemoryBarrier barrier{
      .sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
      .srcAccessMask = from.access,
      .dstAccessMask = to.access,
      .oldLayout = from.layout,
      .newLayout = to.layout,
      .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
      .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
      .image = image.image,
      .subresourceRange = {.aspectMask = image.aspect, .levelCount = image.levels, .layerCount = 1}};
  device.calls().vkCmdPipelineBarrier(commands, from.stage, to.stage, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

void transition(const VulkanDevice& device, VkCommandBuffer commands, const DeviceImage& image, const ImageUse& from,
                const ImageUse& to) {
  transition(device, commands, ref_of(image), from, to);
}

void record_read(const VulkanDevice& device, VkCommandBuffer commands, const ImageRef& image, const ImageUse& before,
                 const ImageUse& after, const HostBuffer& into) {
  const VolkDeviceTable& vk = device.calls();
  transition(device, commands, image, before, kCopyFrom);
  const VkBufferImageCopy region = whole_image(image.extent, image.aspect);
  vk.vkCmdCopyImageToBuffer(commands, image.image, kCopyFrom.layout, into.buffer.get(), 1, &region);
  transition(device, commands, image, kCopyFrom, after);
  // The fence alone does not make the copy visible to the host.
  const VkMemoryBarrier to_host{.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                                .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                                .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
  vk.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0,
                          nullptr, 0, nullptr);
}

void upload_texels(const VulkanDevice& device, const DeviceImage& image, const TexelLayout& layout,
                   std::span<const std::byte> texels) {
  const HostBuffer staging = make_host_buffer(device, texels.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 0);
  std::memcpy(staging.bytes.data(), texels.data(), texels.size());
  const std::vector<VkBufferImageCopy> regions = all_levels(image, layout);
  run_once(device, [&](VkCommandBuffer commands) {
    transition(device, commands, image, kUnused, kCopyTo);
    device.calls().vkCmdCopyBufferToImage(commands, staging.buffer.get(), image.image.get(), kCopyTo.layout,
                                          image.levels, regions.data());
    transition(device, commands, image, kCopyTo, kSampled);
  });
}

std::span<const std::byte> read_texels(const VulkanDevice& device, const DeviceImage& image,
                                       std::size_t bytes_per_texel, HostBuffer& staging) {
  const std::size_t size = std::size_t{image.extent.width} * image.extent.height * bytes_per_texel;
  if (staging.bytes.size() < size)
    staging = make_host_buffer(device, size, VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  run_once(device, [&](VkCommandBuffer commands) {
    record_read(device, commands, ref_of(image), image.rest, image.rest, staging);
  });
  return staging.bytes.first(size);
}

}  // namespace reliefbench
