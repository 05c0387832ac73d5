#include "backends/vulkan/vulkan_pipeline.h"

#include <array>
#include <bit>
#include <cstddef>

#include "backends/vulkan/vulkan_pipeline_cache.h"

namespace reliefbench {
namespace {

std::vector<VkDescriptorSetLayoutBinding> bindings_of(const ShaderInterface& shader, VkShaderStageFlags stages) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  const auto add = [&](const std::vector<ShaderVariable>& list, VkDescriptorType type) {
    for (const ShaderVariable& variable : list)
      bindings.push_back(
          {.binding = variable.place, .descriptorType = type, .descriptorCount = 1, .stageFlags = stages});
  };
  add(shader.uniform_blocks, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER);
  add(shader.samplers, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER);
  add(shader.images, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE);
  return bindings;
}

VkDescriptorSetLayout make_descriptor_layout(const VulkanDevice& device,
                                             std::span<const VkDescriptorSetLayoutBinding> bindings) {
  const VkDescriptorSetLayoutCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                             .bindingCount = static_cast<std::uint32_t>(bindings.size()),
                                             .pBindings = bindings.data()};
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorSetLayout(device.handle(), &info, nullptr, &layout),
           "vkCreateDescriptorSetLayout");
  return layout;
}

VkPipelineLayout make_layout(const VulkanDevice& device, VkDescriptorSetLayout set) {
  const VkPipelineLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set};
  VkPipelineLayout layout = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout), "vkCreatePipelineLayout");
  return layout;
}

VkPipelineShaderStageCreateInfo stage_info(VkShaderStageFlagBits stage, const ShaderModule& module,
                                           const VkSpecializationInfo* constants) {
  return {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
          .stage = stage,
          .module = module.get(),
          .pName = "main",
          .pSpecializationInfo = constants};
}

VkPipeline make_graphics_pipeline(const VulkanDevice& device, VkRenderPass pass, VkPipelineLayout layout,
                                  const PipelineState& state) {
  const std::array stages = {stage_info(VK_SHADER_STAGE_VERTEX_BIT, state.vertex, state.constants),
                             stage_info(VK_SHADER_STAGE_FRAGMENT_BIT, state.fragment, state.constants)};
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
  const VkPipelineColorBlendStateCreateInfo blend{.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
                                                  .attachmentCount = static_cast<std::uint32_t>(state.blending.size()),
                                                  .pAttachments = state.blending.data()};
  const VkPipelineDepthStencilStateCreateInfo nearest{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO,
      .depthTestEnable = VK_TRUE,
      .depthWriteEnable = VK_TRUE,
      .depthCompareOp = VK_COMPARE_OP_LESS};
  const std::array dynamic_states = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  const VkPipelineDynamicStateCreateInfo dynamic{.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
                                                 .dynamicStateCount = static_cast<std::uint32_t>(dynamic_states.size()),
                                                 .pDynamicStates = dynamic_states.data()};
  const VkGraphicsPipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                          .stageCount = static_cast<std::uint32_t>(stages.size()),
                                          .pStages = stages.data(),
                                          .pVertexInputState = &state.vertices,
                                          .pInputAssemblyState = &triangles,
                                          .pViewportState = &viewport,
                                          .pRasterizationState = &rasterization,
                                          .pMultisampleState = &one_sample,
                                          .pDepthStencilState = state.has_depth ? &nearest : nullptr,
                                          .pColorBlendState = &blend,
                                          .pDynamicState = &dynamic,
                                          .layout = layout,
                                          .renderPass = pass};
  VkPipeline handle = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateGraphicsPipelines(device.handle(), state.cache, 1, &info, nullptr, &handle),
           "vkCreateGraphicsPipelines");
  return handle;
}

VkPipeline make_compute_pipeline(const VulkanDevice& device, VkPipelineLayout layout, const ShaderModule& module,
                                 VkPipelineCache cache, const VkSpecializationInfo* constants) {
  const VkComputePipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                                         .stage = stage_info(VK_SHADER_STAGE_COMPUTE_BIT, module, constants),
                                         .layout = layout};
  VkPipeline handle = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateComputePipelines(device.handle(), cache, 1, &info, nullptr, &handle),
           "vkCreateComputePipelines");
  return handle;
}

PipelineHandles make_layouts(const VulkanDevice& device, std::span<const VkDescriptorSetLayoutBinding> bindings) {
  PipelineHandles handles;
  handles.descriptors = {device.logical(), make_descriptor_layout(device, bindings)};
  handles.layout = {device.logical(), make_layout(device, handles.descriptors.get())};
  return handles;
}

}  // namespace

ShaderModule make_module(const VulkanDevice& device, std::span<const std::uint32_t> spirv) {
  static_cast<void>(reflect(spirv));  // refuses a broken module; drivers may crash on one
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

PipelineHandles make_handles(const VulkanDevice& device, VkRenderPass pass, const ShaderInterface& shader,
                             const PipelineState& state) {
  PipelineHandles handles =
      make_layouts(device, bindings_of(shader, VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT));
  handles.handle = {device.logical(), make_graphics_pipeline(device, pass, handles.layout.get(), state)};
  return handles;
}

PipelineHandles make_compute_handles(const VulkanDevice& device, std::span<const VkDescriptorSetLayoutBinding> bindings,
                                     const ShaderModule& module, VkPipelineCache cache,
                                     const VkSpecializationInfo* constants) {
  PipelineHandles handles = make_layouts(device, bindings);
  handles.handle = {device.logical(), make_compute_pipeline(device, handles.layout.get(), module, cache, constants)};
  return handles;
}

VkDescriptorSet allocate_set(const VulkanDevice& device, VkDescriptorPool pool, const PipelineHandles& pipeline) {
  const VkDescriptorSetLayout layout = pipeline.descriptors.get();
  const VkDescriptorSetAllocateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                         .descriptorPool = pool,
                                         .descriptorSetCount = 1,
                                         .pSetLayouts = &layout};
  VkDescriptorSet set = VK_NULL_HANDLE;
  vk_check(device.calls().vkAllocateDescriptorSets(device.handle(), &info, &set), "vkAllocateDescriptorSets");
  return set;
}

std::unique_ptr<VulkanPipeline> make_pipeline(const VulkanDevice& device, VkRenderPass pass, const PipelineDesc& desc) {
  auto pipeline = std::make_unique<VulkanPipeline>();
  pipeline->target = desc.target;
  pipeline->shader = interface_of(desc);
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
  const KeptPipeline kept(device, device.pipelines().key(desc));
  if (desc.target.by_compute) {
    static_cast<PipelineHandles&>(*pipeline) =
        make_compute_handles(device, bindings_of(pipeline->shader, VK_SHADER_STAGE_COMPUTE_BIT),
                             make_module(device, desc.fragment), kept.handle(), &constants);
  } else {
    const ShaderModule vertex = make_module(device, desc.vertex);
    const ShaderModule fragment = make_module(device, desc.fragment);
    constexpr VkPipelineColorBlendAttachmentState kOverwrite{.colorWriteMask = kAllComponents};
    const std::vector overwrite(desc.target.attachments.size(), kOverwrite);
    static_cast<PipelineHandles&>(*pipeline) = make_handles(device, pass, pipeline->shader,
                                                            {.vertex = vertex,
                                                             .fragment = fragment,
                                                             .constants = &constants,
                                                             .blending = overwrite,
                                                             .has_depth = desc.target.has_depth,
                                                             .cache = kept.handle()});
  }
  kept.keep(*pipeline);
  set_name(device, pipeline->handle.get(), desc.label);
  return pipeline;
}

}  // namespace reliefbench
