#pragma once
#include <span>
#include <vector>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"
#include "backends/vulkan/vulkan_target.h"

namespace reliefbench {

/// The descriptor sets of a frame's draws, and the uniform buffer behind them. Rewritten for each batch: all work is
/// over by then.
class Bindings {
 public:
  explicit Bindings(const VulkanDevice& device) : device_(device) {}

  /// target: that the frame goes into
  /// throws: Error(environment): a draw without a texture that its shaders read, or with one of another backend
  void write(std::span<const Draw> frame, const VulkanTarget& target);
  /// Of the frame written last; null for a draw whose shaders read nothing.
  [[nodiscard]] VkDescriptorSet set(std::size_t draw) const { return sets_[draw]; }

 private:
  void make_room(std::size_t draws);
  void make_pool(std::span<const Draw> frame);
  [[nodiscard]] VkDescriptorSet make_set(const Draw& draw, std::size_t index, const VulkanTarget& target);

  const VulkanDevice& device_;
  std::size_t stride_ = 0;  ///< bytes from one draw's uniforms to the next one's
  HostBuffer uniforms_;
  Owned<VkDescriptorPool, &VolkDeviceTable::vkDestroyDescriptorPool> pool_;
  std::vector<VkDescriptorSet> sets_;  ///< the pool's
};

}  // namespace reliefbench
