#pragma once
// A program that uses an export with Vulkan alone: what its README.md says, and nothing of the suite's backends.
#include <gtest/gtest.h>
#include <volk.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <vector>

namespace reliefbench {

// Vulkan's structures are all zero but for what is named.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

/// Draws one triangle with a texture into an offscreen frame.
class RawVulkan {
 public:
  RawVulkan() {
    check(volkInitialize());
    const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_3};
    const VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    check(vkCreateInstance(&info, nullptr, &instance_));
    volkLoadInstance(instance_);
    std::uint32_t count = 1;
    const VkResult listed = vkEnumeratePhysicalDevices(instance_, &count, &gpu_);
    EXPECT_TRUE(listed == VK_SUCCESS || listed == VK_INCOMPLETE);
    const float priority = 1;
    const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                        .queueFamilyIndex = graphics_family(),
                                        .queueCount = 1,
                                        .pQueuePriorities = &priority};
    VkPhysicalDeviceVulkan13Features features{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES,
                                              .dynamicRendering = VK_TRUE};
    const VkDeviceCreateInfo device{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                    .pNext = &features,
                                    .queueCreateInfoCount = 1,
                                    .pQueueCreateInfos = &queue};
    check(vkCreateDevice(gpu_, &device, nullptr, &device_));
    vkGetDeviceQueue(device_, graphics_family(), 0, &queue_);
  }
  ~RawVulkan() {
    vkDeviceWaitIdle(device_);
    for (auto undo = undo_.rbegin(); undo != undo_.rend(); ++undo) (*undo)(device_);
    vkDestroyDevice(device_, nullptr);
    vkDestroyInstance(instance_, nullptr);
  }
  RawVulkan(const RawVulkan&) = delete;
  RawVulkan& operator=(const RawVulkan&) = delete;

  struct Texture {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::span<const std::byte> texels;  ///< R8G8_UNORM, first row at v = 0
  };
  /// vertex, fragment: words of SPIR-V modules
  /// returns: RGBA8, width x height, rows by rising y of the clip space
  std::vector<std::uint8_t> draw(const Texture& map, std::span<const std::uint32_t> vertex,
                                 std::span<const std::uint32_t> fragment, std::uint32_t width, std::uint32_t height) {
    // 1. Upload the texture as it is: linear, no mip levels but those in the file.
    const Image relief = new_image(VK_FORMAT_R8G8_UNORM, map.width, map.height,
                                   VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT);
    const Buffer staging = new_buffer(map.texels.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
    std::memcpy(staging.mapped, map.texels.data(), map.texels.size());
    // 2. Its sampler: linear within a level, nearest between levels, wrap mode repeat on both axes.
    const VkSamplerCreateInfo sampler_info{.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                           .magFilter = VK_FILTER_LINEAR,
                                           .minFilter = VK_FILTER_LINEAR,
                                           .mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST,
                                           .addressModeU = VK_SAMPLER_ADDRESS_MODE_REPEAT,
                                           .addressModeV = VK_SAMPLER_ADDRESS_MODE_REPEAT,
                                           .maxLod = VK_LOD_CLAMP_NONE};
    const auto sampler = made<VkSampler>(vkCreateSampler, vkDestroySampler, sampler_info);
    // 3. The example: relief_map at binding 0; uv, view_ts and light_ts from the vertex shader.
    bind(relief.view, sampler);
    const Image target = new_image(VK_FORMAT_R8G8B8A8_UNORM, width, height,
                                   VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
    const Buffer picture = new_buffer(std::size_t{4} * width * height, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    const VkExtent2D extent{width, height};
    const VkPipeline pipeline = new_pipeline(vertex, fragment, extent);

    const VkCommandBuffer commands = begin();
    change_layout(commands, relief.image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    const VkBufferImageCopy upload = whole_copy(map.width, map.height);
    vkCmdCopyBufferToImage(commands, staging.buffer, relief.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &upload);
    change_layout(commands, relief.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                  VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
    change_layout(commands, target.image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
    const VkRenderingAttachmentInfo color{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                          .imageView = target.view,
                                          .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                          .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                          .storeOp = VK_ATTACHMENT_STORE_OP_STORE};
    const VkRenderingInfo rendering{.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                    .renderArea = {{0, 0}, extent},
                                    .layerCount = 1,
                                    .colorAttachmentCount = 1,
                                    .pColorAttachments = &color};
    vkCmdBeginRendering(commands, &rendering);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1, &set_, 0, nullptr);
    vkCmdDraw(commands, 3, 1, 0, 0);
    vkCmdEndRendering(commands);
    change_layout(commands, target.image, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                  VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    const VkBufferImageCopy back = whole_copy(width, height);
    vkCmdCopyImageToBuffer(commands, target.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, picture.buffer, 1, &back);
    finish(commands);
    const auto* const bytes = static_cast<const std::uint8_t*>(picture.mapped);
    return {bytes, bytes + std::size_t{4} * width * height};
  }

 private:
  struct Image {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
  };
  struct Buffer {
    VkBuffer buffer = VK_NULL_HANDLE;
    void* mapped = nullptr;
  };

  static void check(VkResult result) { EXPECT_EQ(result, VK_SUCCESS); }

  /// An object that goes with the device.
  template <typename Handle, typename Create, typename Destroy, typename Info>
  Handle made(Create create, Destroy destroy, const Info& info) {
    Handle handle = VK_NULL_HANDLE;
    check(create(device_, &info, nullptr, &handle));
    undo_.push_back([=](VkDevice device) { destroy(device, handle, nullptr); });
    return handle;
  }

  [[nodiscard]] std::uint32_t graphics_family() const {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(gpu_, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(gpu_, &count, families.data());
    std::uint32_t family = 0;
    while (family + 1 < count && (families[family].queueFlags & VK_QUEUE_GRAPHICS_BIT) == 0) ++family;
    return family;
  }

  VkDeviceMemory allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags flags) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(gpu_, &memory);
    std::uint32_t type = 0;
    while (type + 1 < memory.memoryTypeCount &&
           ((needs.memoryTypeBits >> type & 1U) == 0 || (memory.memoryTypes[type].propertyFlags & flags) != flags))
      ++type;
    const VkMemoryAllocateInfo info{
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs.size, .memoryTypeIndex = type};
    return made<VkDeviceMemory>(vkAllocateMemory, vkFreeMemory, info);
  }

  Image new_image(VkFormat format, std::uint32_t width, std::uint32_t height, VkImageUsageFlags usage) {
    const VkImageCreateInfo info{.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                 .imageType = VK_IMAGE_TYPE_2D,
                                 .format = format,
                                 .extent = {width, height, 1},
                                 .mipLevels = 1,
                                 .arrayLayers = 1,
                                 .samples = VK_SAMPLE_COUNT_1_BIT,
                                 .usage = usage};
    Image made_image{.image = made<VkImage>(vkCreateImage, vkDestroyImage, info)};
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device_, made_image.image, &needs);
    check(vkBindImageMemory(device_, made_image.image, allocate(needs, 0), 0));
    const VkImageViewCreateInfo view{.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                     .image = made_image.image,
                                     .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                     .format = format,
                                     .subresourceRange = kWhole};
    made_image.view = made<VkImageView>(vkCreateImageView, vkDestroyImageView, view);
    return made_image;
  }

  Buffer new_buffer(std::size_t bytes, VkBufferUsageFlags usage) {
    const VkBufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = bytes, .usage = usage};
    Buffer made_buffer{.buffer = made<VkBuffer>(vkCreateBuffer, vkDestroyBuffer, info)};
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_, made_buffer.buffer, &needs);
    const VkDeviceMemory memory =
        allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    check(vkBindBufferMemory(device_, made_buffer.buffer, memory, 0));
    check(vkMapMemory(device_, memory, 0, VK_WHOLE_SIZE, 0, &made_buffer.mapped));
    return made_buffer;
  }

  void bind(VkImageView view, VkSampler sampler) {
    const VkDescriptorSetLayoutBinding binding{.binding = 0,
                                               .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                               .descriptorCount = 1,
                                               .stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT};
    const VkDescriptorSetLayoutCreateInfo set_info{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, .bindingCount = 1, .pBindings = &binding};
    const auto set_layout =
        made<VkDescriptorSetLayout>(vkCreateDescriptorSetLayout, vkDestroyDescriptorSetLayout, set_info);
    const VkPipelineLayoutCreateInfo layout{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set_layout};
    layout_ = made<VkPipelineLayout>(vkCreatePipelineLayout, vkDestroyPipelineLayout, layout);
    const VkDescriptorPoolSize size{.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, .descriptorCount = 1};
    const VkDescriptorPoolCreateInfo pool_info{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, .maxSets = 1, .poolSizeCount = 1, .pPoolSizes = &size};
    const auto pool = made<VkDescriptorPool>(vkCreateDescriptorPool, vkDestroyDescriptorPool, pool_info);
    const VkDescriptorSetAllocateInfo allocation{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                                 .descriptorPool = pool,
                                                 .descriptorSetCount = 1,
                                                 .pSetLayouts = &set_layout};
    check(vkAllocateDescriptorSets(device_, &allocation, &set_));
    const VkDescriptorImageInfo image{
        .sampler = sampler, .imageView = view, .imageLayout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    const VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                     .dstSet = set_,
                                     .descriptorCount = 1,
                                     .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                     .pImageInfo = &image};
    vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
  }

  VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits kind, std::span<const std::uint32_t> words) {
    const VkShaderModuleCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = words.size_bytes(), .pCode = words.data()};
    return {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
            .stage = kind,
            .module = made<VkShaderModule>(vkCreateShaderModule, vkDestroyShaderModule, info),
            .pName = "main"};
  }

  VkPipeline new_pipeline(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> fragment,
                          VkExtent2D extent) {
    const std::array stages = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex),
                               stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment)};
    const VkPipelineVertexInputStateCreateInfo no_vertices{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    const VkPipelineInputAssemblyStateCreateInfo triangles{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
        .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST};
    const VkViewport viewport{
        .width = static_cast<float>(extent.width), .height = static_cast<float>(extent.height), .maxDepth = 1};
    const VkRect2D scissor{{0, 0}, extent};
    const VkPipelineViewportStateCreateInfo view{.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO,
                                                 .viewportCount = 1,
                                                 .pViewports = &viewport,
                                                 .scissorCount = 1,
                                                 .pScissors = &scissor};
    const VkPipelineRasterizationStateCreateInfo raster{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO, .lineWidth = 1};
    const VkPipelineMultisampleStateCreateInfo samples{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
        .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
    const VkPipelineColorBlendAttachmentState opaque{.colorWriteMask = 0xF};
    const VkPipelineColorBlendStateCreateInfo blend{.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
                                                    .attachmentCount = 1,
                                                    .pAttachments = &opaque};
    const VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
    const VkPipelineRenderingCreateInfo target{.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
                                               .colorAttachmentCount = 1,
                                               .pColorAttachmentFormats = &format};
    const VkGraphicsPipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                            .pNext = &target,
                                            .stageCount = stages.size(),
                                            .pStages = stages.data(),
                                            .pVertexInputState = &no_vertices,
                                            .pInputAssemblyState = &triangles,
                                            .pViewportState = &view,
                                            .pRasterizationState = &raster,
                                            .pMultisampleState = &samples,
                                            .pColorBlendState = &blend,
                                            .layout = layout_};
    VkPipeline pipeline = VK_NULL_HANDLE;
    check(vkCreateGraphicsPipelines(device_, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline));
    undo_.push_back([=](VkDevice device) { vkDestroyPipeline(device, pipeline, nullptr); });
    return pipeline;
  }

  static VkBufferImageCopy whole_copy(std::uint32_t width, std::uint32_t height) {
    return {.imageSubresource = {.aspectMask = VK_IMAGE_ASPECT_COLOR_BIT, .layerCount = 1},
            .imageExtent = {width, height, 1}};
  }

  static void change_layout(VkCommandBuffer commands, VkImage image, VkImageLayout before, VkImageLayout after) {
    const VkImageMemoryBarrier barrier{.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
                                       .srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT,
                                       .dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT,
                                       .oldLayout = before,
                                       .newLayout = after,
                                       .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                       .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                       .image = image,
                                       .subresourceRange = kWhole};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0,
                         nullptr, 0, nullptr, 1, &barrier);
  }

  VkCommandBuffer begin() {
    const VkCommandPoolCreateInfo pool_info{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                            .queueFamilyIndex = graphics_family()};
    const auto pool = made<VkCommandPool>(vkCreateCommandPool, vkDestroyCommandPool, pool_info);
    const VkCommandBufferAllocateInfo allocation{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                                 .commandPool = pool,
                                                 .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                                 .commandBufferCount = 1};
    VkCommandBuffer commands = VK_NULL_HANDLE;
    check(vkAllocateCommandBuffers(device_, &allocation, &commands));
    const VkCommandBufferBeginInfo info{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    check(vkBeginCommandBuffer(commands, &info));
    return commands;
  }

  void finish(VkCommandBuffer commands) {
    check(vkEndCommandBuffer(commands));
    const VkSubmitInfo submission{
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands};
    check(vkQueueSubmit(queue_, 1, &submission, VK_NULL_HANDLE));
    check(vkQueueWaitIdle(queue_));
  }

  static constexpr VkImageSubresourceRange kWhole{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDevice gpu_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  std::vector<std::function<void(VkDevice)>> undo_;
};

#pragma GCC diagnostic pop

}  // namespace reliefbench
