// volk goes first: GLFW offers surfaces only where it sees Vulkan's types.
#include <volk.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cstring>

#include "backends/vulkan/vulkan_backend.h"
#include "backends/vulkan/vulkan_texture.h"
#include "backends/window/panel_mesh.h"
#include "backends/window/panel_pipeline.h"
#include "backends/window/screen.h"
#include "backends/window/swapchain.h"

namespace reliefbench {
namespace {

constexpr std::uint32_t kMostPictures = 32;
constexpr std::size_t kTexelBytes = 4;

std::size_t bytes_of(const ScreenPicture& picture) {
  return static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px) * kTexelBytes;
}

struct VulkanPicture final : ScreenPicture {
  VulkanPicture(const VulkanDevice& vulkan, VkDescriptorPool descriptors, int width, int height)
      : ScreenPicture(width, height), device(vulkan), pool(descriptors) {}
  ~VulkanPicture() override {
    if (set != VK_NULL_HANDLE) device.calls().vkFreeDescriptorSets(device.handle(), pool, 1, &set);
  }
  VulkanPicture(const VulkanPicture&) = delete;
  VulkanPicture& operator=(const VulkanPicture&) = delete;

  const VulkanDevice& device;
  VkDescriptorPool pool;
  std::unique_ptr<VulkanTexture> texture;
  VkDescriptorSet set = VK_NULL_HANDLE;
};

VkDescriptorPool make_pool(const VulkanDevice& device) {
  const VkDescriptorPoolSize size{.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, .descriptorCount = kMostPictures};
  const VkDescriptorPoolCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                        .flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT,
                                        .maxSets = kMostPictures,
                                        .poolSizeCount = 1,
                                        .pPoolSizes = &size};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorPool(device.handle(), &info, nullptr, &pool), "vkCreateDescriptorPool");
  return pool;
}

class VulkanScreen final : public Screen {
 public:
  VulkanScreen(const Window& window, Backend& backend)
      : backend_(backend),
        device_(vulkan_device_of(backend)),
        chain_(device_, window),
        pipeline_(make_panel_pipeline(device_, chain_.pass())),
        pool_(device_.logical(), make_pool(device_)),
        glyphs_(make_glyphs(*this)) {}

  [[nodiscard]] std::unique_ptr<ScreenPicture> make_picture(int width_px, int height_px) override {
    auto picture = std::make_unique<VulkanPicture>(device_, pool_.get(), width_px, height_px);
    const std::vector<std::byte> black(bytes_of(*picture));
    picture->texture = make_texture(device_, {.width = width_px,
                                              .height = height_px,
                                              .layout = {.type = TexelType::unorm8, .channels = 4},
                                              .texels = black,
                                              .wrap = Wrap::clamp,
                                              .filter = Filter::nearest});
    picture->set = make_set(*picture->texture);
    return picture;
  }

  void keep(ScreenPicture& into) override {
    const DeviceImage& drawn = image_in_window(backend_);
    const DeviceImage& kept = static_cast<VulkanPicture&>(into).texture->image;
    const VkImageSubresourceLayers color{.aspectMask = VK_IMAGE_ASPECT_COLOR_BIT, .layerCount = 1};
    const VkImageCopy whole{.srcSubresource = color,
                            .dstSubresource = color,
                            .extent = {.width = kept.extent.width, .height = kept.extent.height, .depth = 1}};
    run_once(device_, [&](VkCommandBuffer commands) {
      transition(device_, commands, drawn, drawn.rest, kCopyFrom);
      transition(device_, commands, kept, kSampled, kCopyTo);
      device_.calls().vkCmdCopyImage(commands, drawn.image.get(), kCopyFrom.layout, kept.image.get(), kCopyTo.layout, 1,
                                     &whole);
      transition(device_, commands, kept, kCopyTo, kSampled);
      transition(device_, commands, drawn, kCopyFrom, drawn.rest);
    });
  }

  void fill(ScreenPicture& into, std::span<const std::uint8_t> rgba8) override {
    upload_texels(device_, static_cast<VulkanPicture&>(into).texture->image, {.type = TexelType::unorm8, .channels = 4},
                  std::as_bytes(rgba8));
  }

  void present(const ImDrawData& drawn, SeenWindow* seen) override {
    const PanelMesh mesh = panel_mesh(drawn, true);
    load(vertices_, std::as_bytes(std::span(mesh.vertices)), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT);
    load(indices_, std::as_bytes(std::span(mesh.indices)), VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
    const Swapchain::Frame frame = chain_.begin();
    if (seen != nullptr && !chain_.can_be_read())
      fail_environment("vulkan: what this window shows cannot be read back");
    const Commands commands(device_, VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT);
    record(commands.handle(), mesh, frame);
    HostBuffer copy;
    if (seen != nullptr) copy = record_copy(commands.handle(), frame);
    chain_.end(commands.end());
    if (seen == nullptr) return;
    const auto [width, height] = frame.extent;
    *seen = {.size = {.width = static_cast<int>(width), .height = static_cast<int>(height)},
             .rgba8 = as_rgba(copy.bytes)};
  }

 private:
  VkDescriptorSet make_set(const VulkanTexture& texture) const {
    VkDescriptorSet set = allocate_set(device_, pool_.get(), pipeline_);
    const VkDescriptorImageInfo image{
        .sampler = texture.sampler.get(), .imageView = texture.image.view.get(), .imageLayout = kSampled.layout};
    const VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                     .dstSet = set,
                                     .descriptorCount = 1,
                                     .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                     .pImageInfo = &image};
    device_.calls().vkUpdateDescriptorSets(device_.handle(), 1, &write, 0, nullptr);
    return set;
  }

  /// Made anew where it is too small.
  void load(HostBuffer& buffer, std::span<const std::byte> bytes, VkBufferUsageFlags usage) const {
    if (buffer.bytes.size() < bytes.size()) buffer = make_host_buffer(device_, 2 * bytes.size(), usage, 0);
    if (!bytes.empty()) std::memcpy(buffer.bytes.data(), bytes.data(), bytes.size());
  }

  void record(VkCommandBuffer commands, const PanelMesh& mesh, const Swapchain::Frame& frame) const {
    const VolkDeviceTable& vk = device_.calls();
    const VkClearValue black{};
    const VkRenderPassBeginInfo pass{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                     .renderPass = chain_.pass(),
                                     .framebuffer = frame.framebuffer,
                                     .renderArea = {.extent = frame.extent},
                                     .clearValueCount = 1,
                                     .pClearValues = &black};
    const VkViewport viewport{.width = static_cast<float>(frame.extent.width),
                              .height = static_cast<float>(frame.extent.height),
                              .maxDepth = 1};
    vk.vkCmdBeginRenderPass(commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
    if (!mesh.parts.empty()) {
      const VkBuffer vertices = vertices_.buffer.get();
      const VkDeviceSize start = 0;
      vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.handle.get());
      vk.vkCmdSetViewport(commands, 0, 1, &viewport);
      vk.vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &start);
      vk.vkCmdBindIndexBuffer(commands, indices_.buffer.get(), 0, VK_INDEX_TYPE_UINT32);
    }
    for (const PanelPart& part : mesh.parts) {
      const VkRect2D scissor{.offset = {.x = part.left_px, .y = part.top_px},
                             .extent = {.width = static_cast<std::uint32_t>(part.width_px),
                                        .height = static_cast<std::uint32_t>(part.height_px)}};
      const VkDescriptorSet set = static_cast<const VulkanPicture*>(part.picture)->set;
      vk.vkCmdSetScissor(commands, 0, 1, &scissor);
      vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.layout.get(), 0, 1, &set, 0,
                                 nullptr);
      vk.vkCmdDrawIndexed(commands, part.count, 1, part.first, 0, 0);
    }
    vk.vkCmdEndRenderPass(commands);
  }

  /// After record(): what the window is going to show.
  [[nodiscard]] HostBuffer record_copy(VkCommandBuffer commands, const Swapchain::Frame& frame) const {
    HostBuffer copy = make_host_buffer(device_, std::size_t{frame.extent.width} * frame.extent.height * kTexelBytes,
                                       VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    constexpr ImageUse kToShow{VK_IMAGE_LAYOUT_PRESENT_SRC_KHR, kDrawn.stage, kDrawn.access};
    constexpr ImageUse kShown{VK_IMAGE_LAYOUT_PRESENT_SRC_KHR, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, 0};
    record_read(device_, commands, {.image = frame.image, .extent = frame.extent}, kToShow, kShown, copy);
    return copy;
  }

  [[nodiscard]] std::vector<std::uint8_t> as_rgba(std::span<const std::byte> bytes) const {
    std::vector<std::uint8_t> rgba8(bytes.size());
    std::memcpy(rgba8.data(), bytes.data(), bytes.size());
    for (std::size_t i = 0; i < rgba8.size(); i += kTexelBytes) {
      if (chain_.is_bgra()) std::swap(rgba8[i], rgba8[i + 2]);
      rgba8[i + 3] = 255;
    }
    return rgba8;
  }

  Backend& backend_;
  const VulkanDevice& device_;
  Swapchain chain_;
  PipelineHandles pipeline_;
  Owned<VkDescriptorPool, &VolkDeviceTable::vkDestroyDescriptorPool> pool_;
  HostBuffer vertices_{};
  HostBuffer indices_{};
  std::unique_ptr<ScreenPicture> glyphs_;
};

}  // namespace

std::unique_ptr<Backend> open_in_vulkan_window(int device_index, const BackendOptions& options) {
  std::uint32_t count = 0;
  const char** extensions = glfwGetRequiredInstanceExtensions(&count);
  if (extensions == nullptr) fail_environment("vulkan: GLFW finds no way to present into a window here");
  return open_vulkan_for_window(device_index, options, {extensions, count});
}

std::unique_ptr<Screen> make_vulkan_screen(const Window& window, Backend& backend) {
  return std::make_unique<VulkanScreen>(window, backend);
}

}  // namespace reliefbench
