#include "backends/vulkan/vulkan_timestamps.h"

#include <array>

#include "backends/counter.h"

namespace reliefbench {

Timestamps::Timestamps(const VulkanDevice& device, std::uint32_t pairs) : device_(device) {
  if (device.physical().timestamp_bits == 0 || device.physical().properties.limits.timestampPeriod <= 0) return;
  const VkQueryPoolCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO, .queryType = VK_QUERY_TYPE_TIMESTAMP, .queryCount = 2 * pairs};
  VkQueryPool queries = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateQueryPool(device.handle(), &info, nullptr, &queries), "vkCreateQueryPool");
  queries_ = {device.logical(), queries};
}

void Timestamps::record_stamp(VkCommandBuffer commands, std::uint32_t query) const {
  constexpr VkAccessFlags kAny = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  const VkMemoryBarrier everything{
      .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = kAny, .dstAccessMask = kAny};
  const VolkDeviceTable& vk = device_.calls();
  const auto barrier = [&] {
    vk.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                            &everything, 0, nullptr, 0, nullptr);
  };
  barrier();
  vk.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_.get(), query);
  barrier();
}

void Timestamps::record_start(VkCommandBuffer commands, std::uint32_t pair) const {
  device_.calls().vkCmdResetQueryPool(commands, queries_.get(), 2 * pair, 2);
  record_stamp(commands, 2 * pair);
}

void Timestamps::record_end(VkCommandBuffer commands, std::uint32_t pair) const {
  record_stamp(commands, 2 * pair + 1);
}

double Timestamps::elapsed_ns(std::uint32_t pair) const {
  std::array<std::uint64_t, 2> ticks{};
  vk_check(
      device_.calls().vkGetQueryPoolResults(device_.handle(), queries_.get(), 2 * pair, 2, sizeof ticks, ticks.data(),
                                            sizeof ticks[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
      "vkGetQueryPoolResults");
  // Only these bits count, and they may have wrapped round between the stamps.
  const auto bits = static_cast<int>(device_.physical().timestamp_bits);
  return static_cast<double>(counter_ticks(ticks[0], ticks[1], bits)) *
         device_.physical().properties.limits.timestampPeriod;
}

}  // namespace reliefbench
