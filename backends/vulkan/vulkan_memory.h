#pragma once
#include <cstddef>
#include <span>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// Host-visible and coherent, mapped for its whole life.
struct HostBuffer {
  Owned<VkDeviceMemory, &VolkDeviceTable::vkFreeMemory> memory;
  Owned<VkBuffer, &VolkDeviceTable::vkDestroyBuffer> buffer;
  std::span<std::byte> bytes;
};
/// preferred: memory properties taken if a host-visible type has them
[[nodiscard]] HostBuffer make_host_buffer(const VulkanDevice& device, std::size_t size, VkBufferUsageFlags usage,
                                          VkMemoryPropertyFlags preferred);

/// Device-local.
struct DeviceBuffer {
  Owned<VkDeviceMemory, &VolkDeviceTable::vkFreeMemory> memory;
  Owned<VkBuffer, &VolkDeviceTable::vkDestroyBuffer> buffer;
};
[[nodiscard]] DeviceBuffer make_device_buffer(const VulkanDevice& device, std::size_t size, VkBufferUsageFlags usage);

using ImageView = Owned<VkImageView, &VolkDeviceTable::vkDestroyImageView>;

/// What an image is used for: its layout, and the stage and accesses that a barrier waits for.
struct ImageUse {
  VkImageLayout layout;
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};
inline constexpr ImageUse kUnused{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0};
inline constexpr ImageUse kCopyTo{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                                  VK_ACCESS_TRANSFER_WRITE_BIT};
inline constexpr ImageUse kCopyFrom{VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                                    VK_ACCESS_TRANSFER_READ_BIT};
inline constexpr ImageUse kSampled{
    VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
    VK_PIPELINE_STAGE_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
    VK_ACCESS_SHADER_READ_BIT};
inline constexpr ImageUse kDrawn{VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                 VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT, VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT};
inline constexpr ImageUse kDrawnDepth{
    VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT,
    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT};
inline constexpr ImageUse kStored{VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                                  VK_ACCESS_SHADER_WRITE_BIT};

/// Device-local, optimal tiling.
struct DeviceImage {
  Owned<VkDeviceMemory, &VolkDeviceTable::vkFreeMemory> memory;
  Owned<VkImage, &VolkDeviceTable::vkDestroyImage> image;
  ImageView view;
  VkExtent2D extent{};
  std::uint32_t levels = 1;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
  ImageUse rest = kSampled;  ///< what it is left as by whatever uses it
};
struct DeviceImageDesc {
  VkExtent2D extent;
  VkFormat format;
  std::string_view format_id;  ///< for messages
  std::size_t texel_bytes;
  VkImageUsageFlags usage;
  VkFormatFeatureFlags features;  ///< that the format must have
  std::uint32_t levels = 1;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
  ImageUse rest = kSampled;
};
/// Unused yet: DeviceImage::rest is what it is going to be.
/// throws: Error(environment) where the device has not all of the format's features, or not this size
[[nodiscard]] DeviceImage make_device_image(const VulkanDevice& device, const DeviceImageDesc& desc);

/// An image, whoever owns it.
struct ImageRef {
  VkImage image;
  VkExtent2D extent;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
  std::uint32_t levels = 1;
};
[[nodiscard]] ImageRef ref_of(const DeviceImage& image);
[[nodiscard]] ImageView make_view(const VulkanDevice& device, const ImageRef& image, VkFormat format);

/// Records the layout transition, with its barrier.
void transition(const VulkanDevice& device, VkCommandBuffer commands, const ImageRef& image, const ImageUse& from,
                const ImageUse& to);
/// ... of all of it.
void transition(const VulkanDevice& device, VkCommandBuffer commands, const DeviceImage& image, const ImageUse& from,
                const ImageUse& to);
/// Records the copy of the first level, tightly packed, to where the host reads it once the commands are done.
/// before, after: what the image is used for
void record_read(const VulkanDevice& device, VkCommandBuffer commands, const ImageRef& image, const ImageUse& before,
                 const ImageUse& after, const HostBuffer& into);

/// Fills an unused image with tightly packed rows, level after level, and leaves it as kSampled.
void upload_texels(const VulkanDevice& device, const DeviceImage& image, const TexelLayout& layout,
                   std::span<const std::byte> texels);
/// Reads an attachment, tightly packed. staging: where the texels lie; made anew
/// where it is too small
[[nodiscard]] std::span<const std::byte> read_texels(const VulkanDevice& device, const DeviceImage& image,
                                                     std::size_t bytes_per_texel, HostBuffer& staging);

}  // namespace reliefbench
