#include "backends/vulkan/vulkan_pipeline_cache.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "kernels/base/clock.h"

namespace reliefbench {
namespace {

/// Whether bytes are a cache of this very driver, and one that something is in: the driver would believe their header.
bool is_of_driver(std::span<const std::byte> bytes, const VkPhysicalDeviceProperties& properties) {
  VkPipelineCacheHeaderVersionOne header;
  if (bytes.size() <= sizeof(header)) return false;
  std::memcpy(&header, bytes.data(), sizeof(header));
  return header.headerSize == sizeof(header) && header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE &&
         header.vendorID == properties.vendorID && header.deviceID == properties.deviceID &&
         std::ranges::equal(header.pipelineCacheUUID, properties.pipelineCacheUUID);
}

}  // namespace

std::string driver_text(const VkPhysicalDeviceProperties& properties) {
  return fmt::format("vulkan {} {} {} {} {:02x}", properties.vendorID, properties.deviceID, properties.driverVersion,
                     properties.apiVersion, fmt::join(properties.pipelineCacheUUID, ""));
}

KeptPipeline::KeptPipeline(const VulkanDevice& device, std::string key) : device_(device), key_(std::move(key)) {
  if (!device.pipelines().keeps()) return;
  const auto known = device.pipelines().get(key_);
  is_known_ = known && is_of_driver(*known, device.physical().properties);
  const VkPipelineCacheCreateInfo info{.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO,
                                       .initialDataSize = is_known_ ? known->size() : 0,
                                       .pInitialData = is_known_ ? known->data() : nullptr};
  VkPipelineCache handle = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreatePipelineCache(device.handle(), &info, nullptr, &handle), "vkCreatePipelineCache");
  handle_ = {device.logical(), handle};
}

std::vector<std::byte> KeptPipeline::bytes() const {
  std::size_t size = 0;
  const auto get = [&](void* into) {
    vk_check(device_.calls().vkGetPipelineCacheData(device_.handle(), handle(), &size, into), "vkGetPipelineCacheData");
  };
  get(nullptr);
  std::vector<std::byte> bytes(size);
  get(bytes.data());
  bytes.resize(size);
  return bytes;
}

void KeptPipeline::keep(Pipeline& made) const {
  made.is_from_cache = is_known_;
  if (is_known_ || handle() == VK_NULL_HANDLE) return;
  const double start_ns = steady_ns();
  const std::vector<std::byte> kept = bytes();
  if (is_of_driver(kept, device_.physical().properties)) device_.pipelines().put(key_, kept);
  made.keeping_ns = steady_ns() - start_ns;
}

}  // namespace reliefbench
