#pragma once
#include <array>

#include "backends/vulkan/vulkan_device.h"
#include "backends/vulkan/vulkan_memory.h"

namespace reliefbench {

using ShaderModule = Owned<VkShaderModule, &VolkDeviceTable::vkDestroyShaderModule>;
/// throws: Error(environment): not a SPIR-V module, or the device does not take it
[[nodiscard]] ShaderModule make_module(const VulkanDevice& device, std::span<const std::uint32_t> spirv);
/// For debuggers; nothing without debug.
void set_name(const VulkanDevice& device, VkPipeline pipeline, const std::string& label);

/// A case's pipeline.
struct VulkanPipeline final : Pipeline {
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> handle;
  Target target = Target::color;
};

/// Formats of a target's attachments.
[[nodiscard]] std::span<const VkFormat> attachment_formats(Target target);

/// What all pipelines of a device share: how they are bound, and how they draw into either target.
class PipelineLayouts {
 public:
  explicit PipelineLayouts(const VulkanDevice& device);

  [[nodiscard]] VkDescriptorSetLayout descriptors() const { return descriptors_.get(); }
  [[nodiscard]] VkPipelineLayout pipeline() const { return pipeline_.get(); }
  [[nodiscard]] VkRenderPass render_pass(Target target) const {
    return passes_[static_cast<std::size_t>(target)].get();
  }

 private:
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> descriptors_;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> pipeline_;
  std::array<Owned<VkRenderPass, &VolkDeviceTable::vkDestroyRenderPass>, 2> passes_;  ///< by Target
};

[[nodiscard]] std::unique_ptr<VulkanPipeline> make_pipeline(const VulkanDevice& device, const PipelineLayouts& layouts,
                                                            const PipelineDesc& desc);

}  // namespace reliefbench
