#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// A compute shader with its descriptor set.
class VulkanCompute final : public Pipeline {
 public:
  VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc);
  /// Backend::compute
  [[nodiscard]] std::vector<std::byte> run(const ComputeJob& job) const;

 private:
  void make_layouts();
  void make_pipeline(const ComputeDesc& desc);
  void make_set();
  void bind(std::span<const VkBuffer> buffers) const;
  void dispatch(int groups_x, int groups_y) const;

  const VulkanDevice& device_;
  std::uint32_t buffers_;  ///< at bindings 0, 1, ...
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> set_layout_;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> layout_;
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> pipeline_;
  Owned<VkDescriptorPool, &VolkDeviceTable::vkDestroyDescriptorPool> pool_;
  VkDescriptorSet set_ = VK_NULL_HANDLE;  ///< the pool's
};

}  // namespace reliefbench
