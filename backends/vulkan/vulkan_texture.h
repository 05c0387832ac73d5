#pragma once
#include <array>
#include <memory>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"

namespace reliefbench {

/// A texture with its sampler.
struct VulkanTexture final : Texture {
  DeviceImage image;
  Owned<VkSampler, &VolkDeviceTable::vkDestroySampler> sampler;
};
/// throws: Error(environment) where the device cannot sample or filter the format, or not at this size
[[nodiscard]] std::unique_ptr<VulkanTexture> make_texture(const VulkanDevice& device, const TextureDesc& desc);

inline constexpr std::uint32_t kTextures = 4;  ///< relief, normals, reference, extra

/// The one descriptor set, and the uniform buffer behind it. Rewritten for each draw: all work is over by then.
class Bindings {
 public:
  Bindings(const VulkanDevice& device, VkDescriptorSetLayout layout);

  [[nodiscard]] VkDescriptorSet set() const { return set_; }
  /// textures: in the order of their bindings
  void write(const FrameUniforms& frame, const std::array<const VulkanTexture*, kTextures>& textures);

 private:
  const VulkanDevice& device_;
  HostBuffer uniforms_;
  Owned<VkDescriptorPool, &VolkDeviceTable::vkDestroyDescriptorPool> pool_;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

}  // namespace reliefbench
