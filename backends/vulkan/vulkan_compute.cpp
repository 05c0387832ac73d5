#include "backends/vulkan/vulkan_compute.h"

#include <vector>

#include "backends/vulkan/vulkan_pipeline.h"
#include "kernels/base/error.h"

namespace reliefbench {

void fail_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted, std::uint32_t limit) {
  fail_environment("vulkan: {} {}; {} takes {}", wanted, what, device.physical().properties.deviceName, limit);
}

VulkanCompute::VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc)
    : bindings_(static_cast<std::uint32_t>(kFirstBufferBinding + desc.buffers)) {
  const std::uint32_t limit = device.physical().properties.limits.maxPerStageDescriptorStorageBuffers;
  if (bindings_ > limit) fail_limit(device, "buffers in a shader", bindings_, limit);
  make_layouts(device);
  make_pipeline(device, desc);
}

void VulkanCompute::make_layouts(const VulkanDevice& device) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (std::uint32_t i = 0; i < bindings_; ++i) {
    bindings.push_back({.binding = i,
                        .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                        .descriptorCount = 1,
                        .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
  }
  const VkDescriptorSetLayoutCreateInfo set_info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                 .bindingCount = bindings_,
                                                 .pBindings = bindings.data()};
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorSetLayout(device.handle(), &set_info, nullptr, &set_layout),
           "vkCreateDescriptorSetLayout");
  set_layout_ = {device.logical(), set_layout};
  const VkPipelineLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set_layout};
  VkPipelineLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout), "vkCreatePipelineLayout");
  layout_ = {device.logical(), layout};
}

void VulkanCompute::make_pipeline(const VulkanDevice& device, const ComputeDesc& desc) {
  const ShaderModule module = make_module(device, desc.spirv);
  const VkComputePipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                                         .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                                   .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                                                   .module = module.get(),
                                                   .pName = "main"},
                                         .layout = layout_.get()};
  VkPipeline pipeline = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
           "vkCreateComputePipelines");
  pipeline_ = {device.logical(), pipeline};
  set_name(device, pipeline, desc.label);
}

}  // namespace reliefbench
