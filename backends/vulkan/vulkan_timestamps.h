#pragma once
#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// A pair of timestamps, each fenced by full pipeline barriers, outside the render passes.
class Timestamps {
 public:
  explicit Timestamps(const VulkanDevice& device);

  [[nodiscard]] bool available() const { return queries_.get() != VK_NULL_HANDLE; }
  void record_start(VkCommandBuffer commands) const;
  void record_end(VkCommandBuffer commands) const;
  [[nodiscard]] double elapsed_ns() const;

 private:
  void record_stamp(VkCommandBuffer commands, std::uint32_t query) const;

  const VulkanDevice& device_;
  Owned<VkQueryPool, &VolkDeviceTable::vkDestroyQueryPool> queries_;
};

}  // namespace reliefbench
