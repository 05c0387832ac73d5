#pragma once
#include <cstdint>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// A compute shader, and the layout of the descriptor set that its passes have.
class VulkanCompute final : public Pipeline {
 public:
  VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc);

  [[nodiscard]] std::uint32_t bindings() const { return bindings_; }  ///< storage buffers, at 0, 1, ...
  [[nodiscard]] VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
  [[nodiscard]] VkPipelineLayout layout() const { return layout_.get(); }
  [[nodiscard]] VkPipeline handle() const { return pipeline_.get(); }

 private:
  void make_layouts(const VulkanDevice& device);
  void make_pipeline(const VulkanDevice& device, const ComputeDesc& desc);

  std::uint32_t bindings_;
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> set_layout_;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> layout_;
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> pipeline_;
};

[[noreturn]] void fail_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted,
                             std::uint32_t limit);

}  // namespace reliefbench
