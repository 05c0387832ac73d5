#pragma once
#include "backends/vulkan/vulkan_pipeline.h"

namespace reliefbench {

/// What draws Dear ImGui's triangles on Vulkan: PanelVertex in, one picture, blended over what is there.
struct PanelPipeline {
  Owned<VkDescriptorSetLayout, &VolkDeviceTable::vkDestroyDescriptorSetLayout> descriptors;
  Owned<VkPipelineLayout, &VolkDeviceTable::vkDestroyPipelineLayout> layout;
  Owned<VkPipeline, &VolkDeviceTable::vkDestroyPipeline> handle;
};
[[nodiscard]] PanelPipeline make_panel_pipeline(const VulkanDevice& device, VkRenderPass pass);

}  // namespace reliefbench
