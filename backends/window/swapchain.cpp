// volk goes first: GLFW offers surfaces only where it sees Vulkan's types.
#include <volk.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>

#include "backends/window/swapchain.h"

namespace reliefbench {
namespace {

VkSurfaceKHR make_surface(const VulkanDevice& device, const Window& window) {
  VkSurfaceKHR surface = VK_NULL_HANDLE;
  vk_check(glfwCreateWindowSurface(device.instance().handle(), window.handle(), nullptr, &surface),
           "glfwCreateWindowSurface");
  return surface;
}

VkSurfaceFormatKHR choose_format(VkPhysicalDevice device, VkSurfaceKHR surface) {
  std::uint32_t count = 0;
  vk_check(vkGetPhysicalDeviceSurfaceFormatsKHR(device, surface, &count, nullptr),
           "vkGetPhysicalDeviceSurfaceFormatsKHR");
  std::vector<VkSurfaceFormatKHR> formats(count);
  vk_check(vkGetPhysicalDeviceSurfaceFormatsKHR(device, surface, &count, formats.data()),
           "vkGetPhysicalDeviceSurfaceFormatsKHR");
  for (const VkFormat wanted : {VK_FORMAT_B8G8R8A8_UNORM, VK_FORMAT_R8G8B8A8_UNORM})
    for (const VkSurfaceFormatKHR& format : formats)
      if (format.format == wanted) return format;
  fail_environment("vulkan: the window takes no colors of 8 bits");
}

VkRenderPass make_window_pass(const VulkanDevice& device, VkFormat format) {
  const VkAttachmentDescription color{.format = format,
                                      .samples = VK_SAMPLE_COUNT_1_BIT,
                                      .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                      .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                      .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
                                      .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
                                      .initialLayout = VK_IMAGE_LAYOUT_UNDEFINED,
                                      .finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR};
  const VkAttachmentReference reference{.attachment = 0, .layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  const VkSubpassDescription subpass{
      .pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS, .colorAttachmentCount = 1, .pColorAttachments = &reference};
  // Drawing waits for the image, which the semaphore hands over at this stage.
  const VkSubpassDependency acquired{.srcSubpass = VK_SUBPASS_EXTERNAL,
                                     .dstSubpass = 0,
                                     .srcStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                                     .dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                                     .dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT};
  const VkRenderPassCreateInfo info{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO,
                                    .attachmentCount = 1,
                                    .pAttachments = &color,
                                    .subpassCount = 1,
                                    .pSubpasses = &subpass,
                                    .dependencyCount = 1,
                                    .pDependencies = &acquired};
  VkRenderPass pass = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateRenderPass(device.handle(), &info, nullptr, &pass), "vkCreateRenderPass");
  return pass;
}

}  // namespace

Swapchain::Swapchain(const VulkanDevice& device, const Window& window)
    : device_(device), window_(window), surface_(make_surface(device, window)) {
  try {
    VkBool32 presents = VK_FALSE;
    vk_check(vkGetPhysicalDeviceSurfaceSupportKHR(device.physical().handle, device.physical().queue_family, surface_,
                                                  &presents),
             "vkGetPhysicalDeviceSurfaceSupportKHR");
    if (presents != VK_TRUE)
      fail_environment("vulkan: {} presents nothing into this window", device.physical().properties.deviceName);
    format_ = choose_format(device.physical().handle, surface_);
    pass_ = {device.logical(), make_window_pass(device, format_.format)};
    acquired_ = make_semaphore();
    const VkFenceCreateInfo info{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    VkFence fence = VK_NULL_HANDLE;
    vk_check(device.calls().vkCreateFence(device.handle(), &info, nullptr, &fence), "vkCreateFence");
    fence_ = {device.logical(), fence};
  } catch (const Error&) {
    vkDestroySurfaceKHR(device_.instance().handle(), surface_, nullptr);
    throw;
  }
}

Swapchain::~Swapchain() {
  device_.calls().vkQueueWaitIdle(device_.queue());
  images_.clear();
  chain_ = {};
  vkDestroySurfaceKHR(device_.instance().handle(), surface_, nullptr);
}

Swapchain::Semaphore Swapchain::make_semaphore() const {
  const VkSemaphoreCreateInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
  VkSemaphore semaphore = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateSemaphore(device_.handle(), &info, nullptr, &semaphore), "vkCreateSemaphore");
  return {device_.logical(), semaphore};
}

Swapchain::Image Swapchain::make_image(VkImage handle) const {
  Image image{.handle = handle,
              .view = make_view(device_, {.image = handle, .extent = extent_}, format_.format),
              .drawn = make_semaphore()};
  const VkImageView view = image.view.get();
  const VkFramebufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                                     .renderPass = pass_.get(),
                                     .attachmentCount = 1,
                                     .pAttachments = &view,
                                     .width = extent_.width,
                                     .height = extent_.height,
                                     .layers = 1};
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateFramebuffer(device_.handle(), &info, nullptr, &framebuffer), "vkCreateFramebuffer");
  image.framebuffer = {device_.logical(), framebuffer};
  return image;
}

void Swapchain::make_images() {
  size_ = window_.size();
  VkSurfaceCapabilitiesKHR can{};
  vk_check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.physical().handle, surface_, &can),
           "vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
  extent_ = can.currentExtent;
  if (extent_.width == UINT32_MAX)
    extent_ = {.width = std::clamp(static_cast<std::uint32_t>(size_.width), can.minImageExtent.width,
                                   can.maxImageExtent.width),
               .height = std::clamp(static_cast<std::uint32_t>(size_.height), can.minImageExtent.height,
                                    can.maxImageExtent.height)};
  can_be_read_ = (can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_SRC_BIT) != 0;
  const std::uint32_t most = can.maxImageCount == 0 ? UINT32_MAX : can.maxImageCount;
  const VkSwapchainCreateInfoKHR info{
      .sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR,
      .surface = surface_,
      .minImageCount = std::min(can.minImageCount + 1, most),
      .imageFormat = format_.format,
      .imageColorSpace = format_.colorSpace,
      .imageExtent = extent_,
      .imageArrayLayers = 1,
      .imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT |
                    (can_be_read_ ? static_cast<VkImageUsageFlags>(VK_IMAGE_USAGE_TRANSFER_SRC_BIT) : 0U),
      .imageSharingMode = VK_SHARING_MODE_EXCLUSIVE,
      .preTransform = can.currentTransform,
      .compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR,
      .presentMode = VK_PRESENT_MODE_FIFO_KHR,  // which every device has
      .clipped = VK_TRUE,
      .oldSwapchain = chain_.get()};
  vk_check(device_.calls().vkQueueWaitIdle(device_.queue()), "vkQueueWaitIdle");
  VkSwapchainKHR chain = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateSwapchainKHR(device_.handle(), &info, nullptr, &chain), "vkCreateSwapchainKHR");
  images_.clear();
  chain_ = {device_.logical(), chain};
  std::uint32_t count = 0;
  vk_check(device_.calls().vkGetSwapchainImagesKHR(device_.handle(), chain, &count, nullptr),
           "vkGetSwapchainImagesKHR");
  std::vector<VkImage> handles(count);
  vk_check(device_.calls().vkGetSwapchainImagesKHR(device_.handle(), chain, &count, handles.data()),
           "vkGetSwapchainImagesKHR");
  for (VkImage handle : handles) images_.push_back(make_image(handle));
}

Swapchain::Frame Swapchain::begin() {
  VkResult result = VK_ERROR_OUT_OF_DATE_KHR;
  if (images_.empty() || size_ != window_.size()) make_images();
  for (int tries = 0; tries < 3 && result == VK_ERROR_OUT_OF_DATE_KHR; ++tries) {
    if (tries > 0) make_images();
    result = device_.calls().vkAcquireNextImageKHR(device_.handle(), chain_.get(), UINT64_MAX, acquired_.get(),
                                                   VK_NULL_HANDLE, &current_);
  }
  if (result != VK_SUBOPTIMAL_KHR) vk_check(result, "vkAcquireNextImageKHR");
  const Image& image = images_[current_];
  return {.image = image.handle, .framebuffer = image.framebuffer.get(), .extent = extent_};
}

void Swapchain::end(VkCommandBuffer commands) {
  const VolkDeviceTable& vk = device_.calls();
  const VkSemaphore acquired = acquired_.get();
  const VkSemaphore drawn = images_[current_].drawn.get();
  const VkFence fence = fence_.get();
  constexpr VkPipelineStageFlags kDraws = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  const VkSubmitInfo submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                            .waitSemaphoreCount = 1,
                            .pWaitSemaphores = &acquired,
                            .pWaitDstStageMask = &kDraws,
                            .commandBufferCount = 1,
                            .pCommandBuffers = &commands,
                            .signalSemaphoreCount = 1,
                            .pSignalSemaphores = &drawn};
  vk_check(vk.vkResetFences(device_.handle(), 1, &fence), "vkResetFences");
  vk_check(vk.vkQueueSubmit(device_.queue(), 1, &submit, fence), "vkQueueSubmit");
  vk_check(vk.vkWaitForFences(device_.handle(), 1, &fence, VK_TRUE, UINT64_MAX), "vkWaitForFences");
  const VkSwapchainKHR chain = chain_.get();
  const VkPresentInfoKHR info{.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR,
                              .waitSemaphoreCount = 1,
                              .pWaitSemaphores = &drawn,
                              .swapchainCount = 1,
                              .pSwapchains = &chain,
                              .pImageIndices = &current_};
  const VkResult result = vk.vkQueuePresentKHR(device_.queue(), &info);
  // A window that changed its size meanwhile: the next begin() makes the images anew.
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR)
    size_ = {};
  else
    vk_check(result, "vkQueuePresentKHR");
}

}  // namespace reliefbench
