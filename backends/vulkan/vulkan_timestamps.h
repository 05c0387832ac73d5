#pragma once
#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

/// Pairs of timestamps, each stamp fenced by full pipeline barriers, outside the render passes.
class Timestamps {
 public:
  explicit Timestamps(const VulkanDevice& device, std::uint32_t pairs = 1);

  [[nodiscard]] bool available() const { return queries_.get() != VK_NULL_HANDLE; }
  void record_start(VkCommandBuffer commands, std::uint32_t pair = 0) const;
  void record_end(VkCommandBuffer commands, std::uint32_t pair = 0) const;
  [[nodiscard]] double elapsed_ns(std::uint32_t pair = 0) const;

 private:
  void record_stamp(VkCommandBuffer commands, std::uint32_t query) const;

  const VulkanDevice& device_;
  Owned<VkQueryPool, &VolkDeviceTable::vkDestroyQueryPool> queries_;
};

}  // namespace reliefbench
