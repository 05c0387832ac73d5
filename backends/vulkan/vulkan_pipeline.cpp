#include "backends/vulkan/vulkan_pipeline.h"

#include <bit>
#include <cstddef>

#include "backends/spirv.h"

namespace reliefbench {
namespace {

VkDescriptorSetLayout make_descriptor_layout(const VulkanDevice& device) {
  const auto fragment_binding = [](int binding, VkDescriptorType type) {
    return VkDescriptorSetLayoutBinding{.binding = static_cast<std::uint32_t>(binding),
                                        .descriptorType = type,
                                        .descriptorCount = 1,
                                        .stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT};
  };
  const std::array bindings = {
      fragment_binding(kFrameBinding, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER),
      fragment_binding(kReliefBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER),
      fragment_binding(kNormalBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER),
      fragment_binding(kReferenceBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER),
      fragment_binding(kExtraBinding, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER),
  };
  const VkDescriptorSetLayoutCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                             .bindingCount = static_cast<std::uint32_t>(bindings.size()),
                                             .pBindings = bindings.data()};
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorSetLayout(device.handle(), &info, nullptr, &layout),
           "vkCreateDescriptorSetLayout");
  return layout;
}

VkRenderPass make_render_pass(const VulkanDevice& device, Target target) {
  std::array<VkAttachmentDescription, 2> attachments{};
  std::array<VkAttachmentReference, 2> references{};
  std::uint32_t count = 0;
  for (const VkFormat format : attachment_formats(target)) {
    // Every pixel is written, so nothing is loaded; the layout never changes between frames.
    attachments[count] = {.format = format,
                          .samples = VK_SAMPLE_COUNT_1_BIT,
                          .loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
                          .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                          .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
                          .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
                          .initialLayout = kDrawn.layout,
                          .finalLayout = kDrawn.layout};
    references[count] = {.attachment = count, .layout = kDrawn.layout};
    ++count;
  }
  const VkSubpassDescription subpass{.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS,
                                     .colorAttachmentCount = count,
                                     .pColorAttachments = references.data()};
  // The barrier between frames: each waits until the one before has left the attachments.
  const VkSubpassDependency frame_before{.srcSubpass = VK_SUBPASS_EXTERNAL,
                                         .dstSubpass = 0,
                                         .srcStageMask = kDrawn.stage,
                                         .dstStageMask = kDrawn.stage,
                                         .srcAccessMask = kDrawn.access,
                                         .dstAccessMask = kDrawn.access};
  const VkRenderPassCreateInfo info{.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO,
                                    .attachmentCount = count,
                                    .pAttachments = attachments.data(),
                                    .subpassCount = 1,
                                    .pSubpasses = &subpass,
                                    .dependencyCount = 1,
                                    .pDependencies = &frame_before};
  VkRenderPass pass = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateRenderPass(device.handle(), &info, nullptr, &pass), "vkCreateRenderPass");
  return pass;
}

VkPipeline make_graphics_pipeline(const VulkanDevice& device, const PipelineLayouts& layouts, Target target,
                                  std::span<const VkPipelineShaderStageCreateInfo> stages) {
  const VkPipelineVertexInputStateCreateInfo no_vertices{.sType =
                                                             VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
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
  constexpr VkPipelineColorBlendAttachmentState kOverwrite{.colorWriteMask =
                                                               VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT |
                                                               VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT};
  const std::array overwrite = {kOverwrite, kOverwrite};
  const VkPipelineColorBlendStateCreateInfo blend{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
      .attachmentCount = static_cast<std::uint32_t>(attachment_formats(target).size()),
      .pAttachments = overwrite.data()};
  const std::array dynamic_states = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  const VkPipelineDynamicStateCreateInfo dynamic{.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
                                                 .dynamicStateCount = static_cast<std::uint32_t>(dynamic_states.size()),
                                                 .pDynamicStates = dynamic_states.data()};
  const VkGraphicsPipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                          .stageCount = static_cast<std::uint32_t>(stages.size()),
                                          .pStages = stages.data(),
                                          .pVertexInputState = &no_vertices,
                                          .pInputAssemblyState = &triangles,
                                          .pViewportState = &viewport,
                                          .pRasterizationState = &rasterization,
                                          .pMultisampleState = &one_sample,
                                          .pColorBlendState = &blend,
                                          .pDynamicState = &dynamic,
                                          .layout = layouts.pipeline(),
                                          .renderPass = layouts.render_pass(target)};
  VkPipeline pipeline = VK_NULL_HANDLE;
  // No pipeline cache: the time to compile is measured.
  vk_check(device.calls().vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
           "vkCreateGraphicsPipelines");
  return pipeline;
}

}  // namespace

ShaderModule make_module(const VulkanDevice& device, std::span<const std::uint32_t> spirv) {
  static_cast<void>(declared_constants(spirv));  // refuses a broken module; drivers may crash on one
  const VkShaderModuleCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = spirv.size_bytes(), .pCode = spirv.data()};
  VkShaderModule module = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateShaderModule(device.handle(), &info, nullptr, &module), "vkCreateShaderModule");
  return {device.logical(), module};
}

void set_name(const VulkanDevice& device, VkPipeline pipeline, const std::string& label) {
  if (device.instance().set_object_name() == nullptr) return;
  const VkDebugUtilsObjectNameInfoEXT info{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
                                           .objectType = VK_OBJECT_TYPE_PIPELINE,
                                           // A pointer or an integer, as the platform has it.
                                           .objectHandle = std::bit_cast<std::uint64_t>(pipeline),
                                           .pObjectName = label.c_str()};
  vk_check(device.instance().set_object_name()(device.handle(), &info), "vkSetDebugUtilsObjectNameEXT");
}

std::span<const VkFormat> attachment_formats(Target target) {
  static constexpr std::array kColor = {VK_FORMAT_R8G8B8A8_UNORM};
  static constexpr std::array kScore = {VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT};
  if (target == Target::score) return kScore;
  return kColor;
}

PipelineLayouts::PipelineLayouts(const VulkanDevice& device)
    : descriptors_(device.logical(), make_descriptor_layout(device)) {
  const VkDescriptorSetLayout set = descriptors_.get();
  const VkPipelineLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set};
  VkPipelineLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout), "vkCreatePipelineLayout");
  pipeline_ = {device.logical(), layout};
  for (const Target target : {Target::color, Target::score}) {
    passes_[static_cast<std::size_t>(target)] = {device.logical(), make_render_pass(device, target)};
  }
}

std::unique_ptr<VulkanPipeline> make_pipeline(const VulkanDevice& device, const PipelineLayouts& layouts,
                                              const PipelineDesc& desc) {
  const ShaderModule vertex = make_module(device, desc.vertex);
  const ShaderModule fragment = make_module(device, desc.fragment);
  std::vector<VkSpecializationMapEntry> entries;
  for (std::size_t i = 0; i < desc.constants.size(); ++i) {
    entries.push_back({.constantID = desc.constants[i].id,
                       .offset = static_cast<std::uint32_t>(i * sizeof(SpecConstant) + offsetof(SpecConstant, value)),
                       .size = sizeof(SpecConstant::value)});
  }
  const VkSpecializationInfo constants{.mapEntryCount = static_cast<std::uint32_t>(entries.size()),
                                       .pMapEntries = entries.data(),
                                       .dataSize = desc.constants.size() * sizeof(SpecConstant),
                                       .pData = desc.constants.data()};
  const auto stage = [&constants](VkShaderStageFlagBits bit, const ShaderModule& module) {
    return VkPipelineShaderStageCreateInfo{.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                           .stage = bit,
                                           .module = module.get(),
                                           .pName = "main",
                                           .pSpecializationInfo = &constants};
  };
  const std::array stages = {stage(VK_SHADER_STAGE_VERTEX_BIT, vertex), stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment)};
  auto pipeline = std::make_unique<VulkanPipeline>();
  pipeline->handle = {device.logical(), make_graphics_pipeline(device, layouts, desc.target, stages)};
  pipeline->target = desc.target;
  set_name(device, pipeline->handle.get(), desc.label);
  return pipeline;
}

}  // namespace reliefbench
