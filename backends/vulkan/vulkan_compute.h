#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_pipeline.h"

namespace reliefbench {

/// A compute shader, and the layout of the descriptor set that its passes have.
class VulkanCompute final : public Pipeline {
 public:
  VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc);

  /// What is bound at 0, 1, ...
  [[nodiscard]] std::span<const VkDescriptorType> bindings() const { return bindings_; }
  [[nodiscard]] VkDescriptorSetLayout set_layout() const { return handles_.descriptors.get(); }
  [[nodiscard]] VkPipelineLayout layout() const { return handles_.layout.get(); }
  [[nodiscard]] VkPipeline handle() const { return handles_.handle.get(); }

 private:
  std::vector<VkDescriptorType> bindings_;
  PipelineHandles handles_;
};

struct DeviceLimit {
  std::string_view name;  ///< the API's
  std::size_t most;
};
/// throws: Error(environment) if so much of what it limits is too much
void check_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted, const DeviceLimit& limit);

}  // namespace reliefbench
