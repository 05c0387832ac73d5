#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "backends/vulkan/vulkan_compute.h"
#include "backends/vulkan/vulkan_memory.h"
#include "backends/vulkan/vulkan_timestamps.h"

namespace reliefbench {

/// Runs a compute job: one submit, but that a pass that may be long has its own.
class VulkanComputeJob {
 public:
  /// The job must live as long. throws: Error(environment): a buffer over the device's limits
  VulkanComputeJob(const VulkanDevice& device, const ComputeJob& job);
  [[nodiscard]] ComputeResult run();

 private:
  void make_sets();
  void bind(VkDescriptorSet set, int binding, const VulkanCompute& pipeline, const VkDescriptorBufferInfo& buffer);
  VkBufferView texel_view(const VkDescriptorBufferInfo& buffer);
  void upload();
  void run(std::size_t pass);
  void dispatch(std::size_t pass, int first_row, int rows);
  [[nodiscard]] std::vector<std::byte> read_back();

  VkCommandBuffer commands();  ///< that are recorded for the next submit
  void begin_part(std::string_view part);
  void end_part();
  void submit();  ///< and waits, and adds up the parts' times

  const VulkanDevice& device_;
  const ComputeJob& job_;
  std::vector<VkDeviceSize> offsets_;  ///< of the job's buffers in the one that holds them all
  DeviceBuffer buffers_;
  HostBuffer dispatches_;  ///< what a pass finds at kDispatchBinding, kStride apart
  Owned<VkDescriptorPool, &VolkDeviceTable::vkDestroyDescriptorPool> pool_;
  std::vector<Owned<VkBufferView, &VolkDeviceTable::vkDestroyBufferView>> views_;
  std::vector<VkDescriptorSet> sets_;  ///< the pool's, one a pass
  Timestamps stamps_;
  HostBuffer staged_;  ///< what the first submit uploads
  std::optional<Commands> recording_;
  std::vector<std::string_view> parts_;  ///< of the next submit, a pair of stamps each
  bool is_in_part_ = false;
  std::vector<ComputeTime> times_;
};

}  // namespace reliefbench
