#include "backends/vulkan/vulkan_compute.h"

#include <algorithm>
#include <vector>

#include "backends/spirv.h"
#include "backends/vulkan/vulkan_pipeline_cache.h"
#include "kernels/base/error.h"

namespace reliefbench {

void check_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted, const DeviceLimit& limit) {
  if (wanted > limit.most)
    fail_environment("vulkan: {} {}; {} takes {} ({})", wanted, what, device.physical().properties.deviceName,
                     limit.most, limit.name);
}

namespace {

VkDescriptorType descriptor_of(BufferView view) {
  if (view == BufferView::block) return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  return view == BufferView::texels ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

}  // namespace

VulkanCompute::VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc) {
  for (const BufferView view : buffer_views(desc.spirv, kFirstBufferBinding + desc.buffers))
    bindings_.push_back(descriptor_of(view));
  const auto storage = static_cast<std::size_t>(std::ranges::count(bindings_, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER));
  check_limit(
      device, "storage buffers in a shader", storage,
      {"maxPerStageDescriptorStorageBuffers", device.physical().properties.limits.maxPerStageDescriptorStorageBuffers});
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  bindings.reserve(bindings_.size());
  for (const VkDescriptorType type : bindings_)
    bindings.push_back({.binding = static_cast<std::uint32_t>(bindings.size()),
                        .descriptorType = type,
                        .descriptorCount = 1,
                        .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
  const KeptPipeline kept(device, device.pipelines().key(desc));
  handles_ = make_compute_handles(device, bindings, make_module(device, desc.spirv), kept.handle());
  kept.keep(*this);
  set_name(device, handle(), desc.label);
}

}  // namespace reliefbench
