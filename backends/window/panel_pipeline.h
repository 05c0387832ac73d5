#pragma once
#include "backends/vulkan/vulkan_pipeline.h"

namespace reliefbench {

/// What draws Dear ImGui's triangles on Vulkan: PanelVertex in, one picture, blended over what is there.
[[nodiscard]] PipelineHandles make_panel_pipeline(const VulkanDevice& device, VkRenderPass pass);

}  // namespace reliefbench
