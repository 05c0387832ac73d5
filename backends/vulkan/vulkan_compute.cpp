#include "backends/vulkan/vulkan_compute.h"

#include <cassert>
#include <cstring>

#include "backends/compute_bands.h"
#include "backends/vulkan/vulkan_memory.h"
#include "backends/vulkan/vulkan_pipeline.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

struct Access {
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};
constexpr Access kCopied{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT};
constexpr Access kCopying{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT};
constexpr Access kComputed{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT};
constexpr Access kComputing{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT};
constexpr Access kRead{VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT};

void barrier(const VulkanDevice& device, VkCommandBuffer commands, const Access& from, const Access& to) {
  const VkMemoryBarrier memory{
      .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = from.access, .dstAccessMask = to.access};
  device.calls().vkCmdPipelineBarrier(commands, from.stage, to.stage, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

void copy(const VulkanDevice& device, VkCommandBuffer commands, VkBuffer from, VkBuffer to, std::size_t bytes) {
  const VkBufferCopy all{.size = bytes};
  device.calls().vkCmdCopyBuffer(commands, from, to, 1, &all);
}

[[noreturn]] void fail_limit(const VulkanDevice& device, std::string_view what, std::size_t wanted,
                             std::uint32_t limit) {
  fail_environment("vulkan: {} {}; {} takes {}", wanted, what, device.physical().properties.deviceName, limit);
}

void check_size(const VulkanDevice& device, std::size_t bytes) {
  const std::uint32_t limit = device.physical().properties.limits.maxStorageBufferRange;
  if (bytes > limit) fail_limit(device, "bytes in a buffer", bytes, limit);
}

DeviceBuffer upload(const VulkanDevice& device, std::span<const std::byte> bytes) {
  check_size(device, bytes.size());
  DeviceBuffer buffer =
      make_device_buffer(device, bytes.size(), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT);
  const HostBuffer staging = make_host_buffer(device, bytes.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 0);
  std::memcpy(staging.bytes.data(), bytes.data(), bytes.size());
  run_once(device, [&](VkCommandBuffer commands) {
    copy(device, commands, staging.buffer.get(), buffer.buffer.get(), bytes.size());
    barrier(device, commands, kCopied, kComputing);
  });
  return buffer;
}

/// The last dispatch's output.
std::vector<std::byte> download(const VulkanDevice& device, const DeviceBuffer& buffer, std::size_t bytes) {
  const HostBuffer staging =
      make_host_buffer(device, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  run_once(device, [&](VkCommandBuffer commands) {
    barrier(device, commands, kComputed, kCopying);
    copy(device, commands, buffer.buffer.get(), staging.buffer.get(), bytes);
    barrier(device, commands, kCopied, kRead);
  });
  return {staging.bytes.begin(), staging.bytes.end()};
}

}  // namespace

VulkanCompute::VulkanCompute(const VulkanDevice& device, const ComputeDesc& desc)
    : device_(device), buffers_(static_cast<std::uint32_t>(kFirstInputBinding + desc.inputs)) {
  const std::uint32_t limit = device.physical().properties.limits.maxPerStageDescriptorStorageBuffers;
  if (buffers_ > limit) fail_limit(device, "buffers in a shader", buffers_, limit);
  make_layouts();
  make_pipeline(desc);
  make_set();
}

void VulkanCompute::make_layouts() {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (std::uint32_t i = 0; i < buffers_; ++i) {
    bindings.push_back({.binding = i,
                        .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                        .descriptorCount = 1,
                        .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
  }
  const VkDescriptorSetLayoutCreateInfo set_info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                 .bindingCount = buffers_,
                                                 .pBindings = bindings.data()};
  VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateDescriptorSetLayout(device_.handle(), &set_info, nullptr, &set_layout),
           "vkCreateDescriptorSetLayout");
  set_layout_ = {device_.logical(), set_layout};
  const VkPipelineLayoutCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = &set_layout};
  VkPipelineLayout layout = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreatePipelineLayout(device_.handle(), &info, nullptr, &layout), "vkCreatePipelineLayout");
  layout_ = {device_.logical(), layout};
}

void VulkanCompute::make_pipeline(const ComputeDesc& desc) {
  const ShaderModule module = make_module(device_, desc.spirv);
  const VkComputePipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
                                         .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                                                   .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                                                   .module = module.get(),
                                                   .pName = "main"},
                                         .layout = layout_.get()};
  VkPipeline pipeline = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateComputePipelines(device_.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
           "vkCreateComputePipelines");
  pipeline_ = {device_.logical(), pipeline};
  set_name(device_, pipeline, desc.label);
}

void VulkanCompute::make_set() {
  const VkDescriptorPoolSize size{.type = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .descriptorCount = buffers_};
  const VkDescriptorPoolCreateInfo pool_info{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, .maxSets = 1, .poolSizeCount = 1, .pPoolSizes = &size};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateDescriptorPool(device_.handle(), &pool_info, nullptr, &pool),
           "vkCreateDescriptorPool");
  pool_ = {device_.logical(), pool};
  const VkDescriptorSetLayout layout = set_layout_.get();
  const VkDescriptorSetAllocateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                         .descriptorPool = pool,
                                         .descriptorSetCount = 1,
                                         .pSetLayouts = &layout};
  vk_check(device_.calls().vkAllocateDescriptorSets(device_.handle(), &info, &set_), "vkAllocateDescriptorSets");
}

void VulkanCompute::bind(std::span<const VkBuffer> buffers) const {
  for (std::uint32_t i = 0; i < buffers_; ++i) {
    const VkDescriptorBufferInfo whole{.buffer = buffers[i], .range = VK_WHOLE_SIZE};
    const VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                     .dstSet = set_,
                                     .dstBinding = i,
                                     .descriptorCount = 1,
                                     .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
                                     .pBufferInfo = &whole};
    device_.calls().vkUpdateDescriptorSets(device_.handle(), 1, &write, 0, nullptr);
  }
}

void VulkanCompute::dispatch(int groups_x, int groups_y) const {
  const VolkDeviceTable& vk = device_.calls();
  run_once(device_, [&](VkCommandBuffer commands) {
    vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_.get());
    vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_.get(), 0, 1, &set_, 0, nullptr);
    vk.vkCmdDispatch(commands, static_cast<std::uint32_t>(groups_x), static_cast<std::uint32_t>(groups_y), 1);
  });
}

std::vector<std::byte> VulkanCompute::run(const ComputeJob& job) const {
  assert(job.inputs.size() + kFirstInputBinding == buffers_);
  check_size(device_, job.output_bytes);
  const DeviceBuffer output = make_device_buffer(device_, job.output_bytes,
                                                 VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
  const HostBuffer band = make_host_buffer(device_, sizeof(int), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, 0);
  std::vector<DeviceBuffer> inputs;
  std::vector<VkBuffer> buffers{output.buffer.get(), band.buffer.get()};
  for (const std::span<const std::byte> bytes : job.inputs) {
    inputs.push_back(upload(device_, bytes));
    buffers.push_back(inputs.back().buffer.get());
  }
  bind(buffers);
  run_in_bands(job.groups_y, [&](int first, int count) {
    // Written before the submit that reads it, which makes it visible; the band before has ended.
    std::memcpy(band.bytes.data(), &first, sizeof(first));
    dispatch(job.groups_x, count);
  });
  return download(device_, output, job.output_bytes);
}

}  // namespace reliefbench
