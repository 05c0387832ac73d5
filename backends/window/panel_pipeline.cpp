#include "backends/window/panel_pipeline.h"

#include <array>
#include <cstddef>

#include "backends/shader_compiler.h"
#include "backends/window/panel_mesh.h"

namespace reliefbench {
namespace {

VkDescriptorSetLayout make_picture_layout(const VulkanDevice& device) {
  const VkDescriptorSetLayoutBinding picture{.binding = 0,
                                             .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                                             .descriptorCount = 1,
                                             .stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT};
  const VkDescriptorSetLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, .bindingCount = 1, .pBindings = &picture};
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorSetLayout(device.handle(), &info, nullptr, &layout),
           "vkCreateDescriptorSetLayout");
  return layout;
}

VkPipelineLayout make_panel_layout(const VulkanDevice& device, VkDescriptorSetLayout set) {
  const VkPipelineLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set};
  VkPipelineLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout), "vkCreatePipelineLayout");
  return layout;
}

VkPipeline make_blending_pipeline(const VulkanDevice& device, VkRenderPass pass, VkPipelineLayout layout,
                                  std::span<const VkPipelineShaderStageCreateInfo> stages) {
  const VkVertexInputBindingDescription corner{.binding = 0, .stride = sizeof(PanelVertex)};
  const std::array attributes = {
      VkVertexInputAttributeDescription{
          .location = 0, .format = VK_FORMAT_R32G32_SFLOAT, .offset = offsetof(PanelVertex, x)},
      VkVertexInputAttributeDescription{
          .location = 1, .format = VK_FORMAT_R32G32_SFLOAT, .offset = offsetof(PanelVertex, u)},
      VkVertexInputAttributeDescription{
          .location = 2, .format = VK_FORMAT_R8G8B8A8_UNORM, .offset = offsetof(PanelVertex, color)}};
  const VkPipelineVertexInputStateCreateInfo vertices{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
      .vertexBindingDescriptionCount = 1,
      .pVertexBindingDescriptions = &corner,
      .vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size()),
      .pVertexAttributeDescriptions = attributes.data()};
  const VkPipelineInputAssemblyStateCreateInfo triangles{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO,
      .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST};
  const VkPipelineViewportStateCreateInfo viewport{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO, .viewportCount = 1, .scissorCount = 1};
  const VkPipelineRasterizationStateCreateInfo rasterization{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO,
      .polygonMode = VK_POLYGON_MODE_FILL,
      .cullMode = VK_CULL_MODE_NONE,
      .lineWidth = 1};
  const VkPipelineMultisampleStateCreateInfo one_sample{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO, .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
  const VkPipelineColorBlendAttachmentState over{.blendEnable = VK_TRUE,
                                                 .srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA,
                                                 .dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                                 .colorBlendOp = VK_BLEND_OP_ADD,
                                                 .srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
                                                 .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                                 .alphaBlendOp = VK_BLEND_OP_ADD,
                                                 .colorWriteMask = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT |
                                                                   VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT};
  const VkPipelineColorBlendStateCreateInfo blend{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO, .attachmentCount = 1, .pAttachments = &over};
  const std::array dynamic_states = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  const VkPipelineDynamicStateCreateInfo dynamic{.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
                                                 .dynamicStateCount = static_cast<std::uint32_t>(dynamic_states.size()),
                                                 .pDynamicStates = dynamic_states.data()};
  const VkGraphicsPipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                          .stageCount = static_cast<std::uint32_t>(stages.size()),
                                          .pStages = stages.data(),
                                          .pVertexInputState = &vertices,
                                          .pInputAssemblyState = &triangles,
                                          .pViewportState = &viewport,
                                          .pRasterizationState = &rasterization,
                                          .pMultisampleState = &one_sample,
                                          .pColorBlendState = &blend,
                                          .pDynamicState = &dynamic,
                                          .layout = layout,
                                          .renderPass = pass};
  VkPipeline handle = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &handle),
           "vkCreateGraphicsPipelines");
  return handle;
}

}  // namespace

PanelPipeline make_panel_pipeline(const VulkanDevice& device, VkRenderPass pass) {
  const ShaderModule vertex = make_module(device, compile_panel(PanelStage::vertex, Dialect::vulkan));
  const ShaderModule fragment = make_module(device, compile_panel(PanelStage::fragment, Dialect::vulkan));
  const auto stage = [](VkShaderStageFlagBits bit, const ShaderModule& module) {
    return VkPipelineShaderStageCreateInfo{.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                           .stage = bit,
                                           .module = module.get(),
                                           .pName = "main"};
  };
  const std::array stages = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex), stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment)};
  PanelPipeline pipeline;
  pipeline.descriptors = {device.logical(), make_picture_layout(device)};
  pipeline.layout = {device.logical(), make_panel_layout(device, pipeline.descriptors.get())};
  pipeline.handle = {device.logical(), make_blending_pipeline(device, pass, pipeline.layout.get(), stages)};
  set_name(device, pipeline.handle.get(), "panel");
  return pipeline;
}

}  // namespace reliefbench
