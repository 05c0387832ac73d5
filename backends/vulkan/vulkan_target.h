#pragma once
#include <list>
#include <optional>
#include <string_view>
#include <vector>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"

namespace reliefbench {

/// A Target with the images that its frames were last drawn into.
struct VulkanTarget {
  Target target;
  Owned<VkRenderPass, &VolkDeviceTable::vkDestroyRenderPass> pass{};  ///< none by compute
  std::vector<DeviceImage> images{};  ///< the colors, then the depth; empty: nothing was drawn yet
  Owned<VkFramebuffer, &VolkDeviceTable::vkDestroyFramebuffer> framebuffer{};  ///< likewise
  VkExtent2D extent{};
};

/// Every Target that a device was asked to draw into.
class FrameTargets {
 public:
  explicit FrameTargets(const VulkanDevice& device) : device_(device) {}

  /// For pipelines. It stays. Null for a target by compute.
  [[nodiscard]] VkRenderPass render_pass(const Target& target) { return find(target).pass.get(); }
  /// Makes the images anew where the size changed.
  /// throws: Error(environment): the device cannot draw into a frame of this size
  [[nodiscard]] const VulkanTarget& prepare(const Target& target, VkExtent2D extent);
  struct Drawn {
    const DeviceImage& image;
    std::size_t texel_bytes;
  };
  /// The attachment of that name in the target prepared last of those that have it; none: none has
  [[nodiscard]] std::optional<Drawn> drawn(std::string_view attachment) const;

 private:
  [[nodiscard]] VulkanTarget& find(const Target& target);

  const VulkanDevice& device_;
  std::list<VulkanTarget> targets_;  ///< the one prepared last at the front
};

}  // namespace reliefbench
