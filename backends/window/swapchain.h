#pragma once
#include <vector>

#include "backends/vulkan/vulkan_memory.h"
#include "backends/window/window.h"

namespace reliefbench {

/// A window's images, and the pass that draws into them. One frame at a time: each is at its end before the next.
class Swapchain {
 public:
  /// throws: Error(environment): the device presents nothing into this window
  Swapchain(const VulkanDevice& device, const Window& window);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  struct Frame {
    VkImage image;
    VkFramebuffer framebuffer;
    VkExtent2D extent;
  };
  /// The image to draw into next, of the window's size.
  [[nodiscard]] Frame begin();
  /// Runs what draws into it to its end, and shows it.
  void end(VkCommandBuffer commands);

  [[nodiscard]] VkRenderPass pass() const { return pass_.get(); }
  /// Leaves the image to be copied from, not to be shown; where can_be_read().
  [[nodiscard]] bool can_be_read() const { return can_be_read_; }
  [[nodiscard]] bool is_bgra() const { return format_.format == VK_FORMAT_B8G8R8A8_UNORM; }

 private:
  using Semaphore = Owned<VkSemaphore, &VolkDeviceTable::vkDestroySemaphore>;
  struct Image {
    VkImage handle;
    ImageView view;
    Owned<VkFramebuffer, &VolkDeviceTable::vkDestroyFramebuffer> framebuffer{};
    Semaphore drawn;  ///< before it is shown
  };
  [[nodiscard]] Semaphore make_semaphore() const;
  [[nodiscard]] Image make_image(VkImage handle) const;
  void make_images();

  const VulkanDevice& device_;
  const Window& window_;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkSurfaceFormatKHR format_{};
  bool can_be_read_ = false;
  Owned<VkRenderPass, &VolkDeviceTable::vkDestroyRenderPass> pass_;
  Semaphore acquired_;
  Owned<VkFence, &VolkDeviceTable::vkDestroyFence> fence_;
  Owned<VkSwapchainKHR, &VolkDeviceTable::vkDestroySwapchainKHR> chain_;
  Size size_{};  ///< that the images are for
  VkExtent2D extent_{};
  std::vector<Image> images_;
  std::uint32_t current_ = 0;
};

}  // namespace reliefbench
