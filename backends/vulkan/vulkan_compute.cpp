#include "backends/vulkan/vulkan_compute.h"

#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {

void fail_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted, std::uint32_t limit) {
  fail_environment("vulkan: {} {}; {} takes {}", wanted, what, device.physical().properties.deviceName, limit);
}

VulkanCompute::VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc)
    : bindings_(static_cast<std::uint32_t>(kFirstBufferBinding + desc.buffers)) {
  const std::uint32_t limit = device.physical().properties.limits.maxPerStageDescriptorStorageBuffers;
  if (bindings_ > limit) fail_limit(device, "buffers in a shader", bindings_, limit);
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  bindings.reserve(bindings_);
  for (std::uint32_t i = 0; i < bindings_; ++i)
    bindings.push_back({.binding = i,
                        .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                        .descriptorCount = 1,
                        .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
  handles_ = make_compute_handles(device, bindings, make_module(device, desc.spirv));
  set_name(device, handle(), desc.label);
}

}  // namespace reliefbench
