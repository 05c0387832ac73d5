#pragma once
#include <memory>
#include <vector>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"

namespace reliefbench {

[[nodiscard]] VkFormat vulkan_format(const TexelLayout& texel);

/// A texture with its sampler.
struct VulkanTexture final : Texture {
  DeviceImage image;
  Owned<VkSampler, &VolkDeviceTable::vkDestroySampler> sampler;
};
/// throws: Error(environment) where the device cannot sample or filter the format, or not at this size
[[nodiscard]] std::unique_ptr<VulkanTexture> make_texture(const VulkanDevice& device, const TextureDesc& desc);

}  // namespace reliefbench
