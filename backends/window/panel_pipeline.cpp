#include "backends/window/panel_pipeline.h"

#include <array>
#include <cstddef>

#include "backends/shader_compiler.h"
#include "backends/window/panel_mesh.h"

namespace reliefbench {

PipelineHandles make_panel_pipeline(const VulkanDevice& device, VkRenderPass pass) {
  const Spirv vertex = compile_panel(PanelStage::vertex, Dialect::vulkan);
  const Spirv fragment = compile_panel(PanelStage::fragment, Dialect::vulkan);
  const ShaderModule vertex_module = make_module(device, vertex);
  const ShaderModule fragment_module = make_module(device, fragment);
  const VkVertexInputBindingDescription corner{.binding = 0, .stride = sizeof(PanelVertex)};
  const std::array attributes = {
      VkVertexInputAttributeDescription{
          .location = 0, .format = VK_FORMAT_R32G32_SFLOAT, .offset = offsetof(PanelVertex, x)},
      VkVertexInputAttributeDescription{
          .location = 1, .format = VK_FORMAT_R32G32_SFLOAT, .offset = offsetof(PanelVertex, u)},
      VkVertexInputAttributeDescription{
          .location = 2, .format = VK_FORMAT_R8G8B8A8_UNORM, .offset = offsetof(PanelVertex, color)}};
  const VkPipelineColorBlendAttachmentState over{.blendEnable = VK_TRUE,
                                                 .srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA,
                                                 .dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                                 .colorBlendOp = VK_BLEND_OP_ADD,
                                                 .srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE,
                                                 .dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                                 .alphaBlendOp = VK_BLEND_OP_ADD,
                                                 .colorWriteMask = kAllComponents};
  PipelineState state{.vertex = vertex_module, .fragment = fragment_module, .blending = {&over, 1}};
  state.vertices.vertexBindingDescriptionCount = 1;
  state.vertices.pVertexBindingDescriptions = &corner;
  state.vertices.vertexAttributeDescriptionCount = static_cast<std::uint32_t>(attributes.size());
  state.vertices.pVertexAttributeDescriptions = attributes.data();
  PipelineHandles pipeline = make_handles(device, pass, joined(reflect(vertex), reflect(fragment)), state);
  set_name(device, pipeline.handle.get(), "panel");
  return pipeline;
}

}  // namespace reliefbench
