#pragma once
#include <memory>

#include "backends/vulkan/vulkan_device.h"

namespace reliefbench {

using ShaderModule = Owned<VkShaderModule, &VolkDeviceTable::vkDestroyShaderModule>;
/// throws: Error(environment): not a SPIR-V module, or the device does not take it
[[nodiscard]] ShaderModule make_module(const VulkanDevice& device, std::span<const std::uint32_t> spirv);
/// For debuggers; nothing without debug.
void set_name(const VulkanDevice& device, VkPipeline pipeline, const std::string& label);

/// A pipeline with what its shaders read.
struct VulkanPipeline final : Pipeline {
  Target target;
  ShaderInterface shader;
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> descriptors;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> layout;
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> handle;
};
/// pass: of the target
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
