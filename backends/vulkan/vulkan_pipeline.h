#pragma once
#include <memory>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

using ShaderModule = Owned<VkShaderModule, &VolkDeviceTable::vkDestroyShaderModule>;
/// throws: Error(environment): not a SPIR-V module, or the device does not take it
[[nodiscard]] ShaderModule make_module(const VulkanDevice& device, std::span<const std::uint32_t> spirv);
/// For debuggers; nothing without debug.
void set_name(const VulkanDevice& device, VkPipeline pipeline, const std::string& label);

/// A pipeline's handles.
struct PipelineHandles {
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> descriptors;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> layout;
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> handle;
};
/// What pipelines differ in beside what their shaders read. All draw triangles, whole, whatever their winding; viewport
/// and scissor are set by commands.
struct PipelineState {
  const ShaderModule& vertex;
  const ShaderModule& fragment;
  const VkSpecializationInfo* constants = nullptr;  ///< of both stages
  VkPipelineVertexInputStateCreateInfo vertices{.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
  std::span<const VkPipelineColorBlendAttachmentState> blending{};  ///< an attachment each
  bool has_depth = false;                                           ///< nearest wins
  VkPipelineCache cache = VK_NULL_HANDLE;
};
inline constexpr VkColorComponentFlags kAllComponents =
    VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
/// shader: of both stages together
[[nodiscard]] PipelineHandles make_handles(const VulkanDevice& device, VkRenderPass pass, const ShaderInterface& shader,
                                           const PipelineState& state);

/// Of a compute shader. constants: null for none
[[nodiscard]] PipelineHandles make_compute_handles(const VulkanDevice& device,
                                                   std::span<const VkDescriptorSetLayoutBinding> bindings,
                                                   const ShaderModule& module, VkPipelineCache cache,
                                                   const VkSpecializationInfo* constants = nullptr);

/// A set that a pipeline's shaders read from; nothing is in it yet.
[[nodiscard]] VkDescriptorSet allocate_set(const VulkanDevice& device, VkDescriptorPool pool,
                                           const PipelineHandles& pipeline);

/// A pipeline with what its shaders read.
struct VulkanPipeline final : Pipeline, PipelineHandles {
  Target target;
  ShaderInterface shader;
};
/// pass: of the target; null where it is by compute
[[nodiscard]] std::unique_ptr<VulkanPipeline> make_pipeline(const VulkanDevice& device, VkRenderPass pass,
                                                            const PipelineDesc& desc);

/// An object of this backend, out of the interface's pointer.
/// throws: Error(environment): null, or of another backend
template <typename Mine, typename Base>
const Mine& own(const Base* object, std::string_view what) {
  const auto* mine = dynamic_cast<const Mine*>(object);
  if (mine == nullptr) fail_environment("vulkan: the {} is missing or of another backend", what);
  return *mine;
}

}  // namespace reliefbench
