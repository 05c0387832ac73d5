#pragma once
#include <string>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// All that the bytes of a device's pipelines depend on.
[[nodiscard]] std::string driver_text(const VkPhysicalDeviceProperties& properties);

/// One pipeline's way from the cache on disk and into it. Each pipeline has a VkPipelineCache of its own: a file holds
/// what one of them is made from, and threads that compile wait for no other.
class KeptPipeline {
 public:
  /// key: the pipeline's, in the device's PipelineCache
  KeptPipeline(const VulkanDevice& device, std::string key);

  /// What to make the pipeline with; null where none are kept.
  [[nodiscard]] VkPipelineCache handle() const { return handle_.get(); }
  /// Puts into the cache what the driver made, and says in the pipeline what came of it.
  void keep(Pipeline& made) const;

 private:
  [[nodiscard]] std::vector<std::byte> bytes() const;

  const VulkanDevice& device_;
  std::string key_;
  bool is_known_ = false;
  Owned<VkPipelineCache, &VolkDeviceTable::vkDestroyPipelineCache> handle_;
};

}  // namespace reliefbench
