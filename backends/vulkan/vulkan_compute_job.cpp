#include "backends/vulkan/vulkan_compute_job.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <map>

#include "backends/compute_bands.h"
#include "backends/spirv.h"

namespace reliefbench {
namespace {

constexpr std::size_t kStride = 256;  // the greatest alignment of a buffer's offset that Vulkan allows

struct Access {
  VkPipelineStageFlags stage;
  VkAccessFlags access;
};
constexpr Access kCopied{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT};
constexpr Access kCopying{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT};
constexpr Access kComputed{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT};
constexpr Access kComputing{VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                            VK_ACCESS_UNIFORM_READ_BIT | VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT};
constexpr Access kRead{VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT};

void barrier(const VulkanDevice& device, VkCommandBuffer commands, const Access& from, const Access& to) {
  const VkMemoryBarrier memory{
      .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = from.access, .dstAccessMask = to.access};
  device.calls().vkCmdPipelineBarrier(commands, from.stage, to.stage, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

const VulkanCompute& pipeline_of(const ComputePass& pass) {
  assert(pass.pipeline);
  return static_cast<const VulkanCompute&>(*pass.pipeline);
}

/// Where the buffers begin in one that holds them all; its size last.
std::vector<VkDeviceSize> offsets_of(const VulkanDevice& device, const std::vector<ComputeBuffer>& buffers) {
  const DeviceLimit limit{"maxStorageBufferRange", device.physical().properties.limits.maxStorageBufferRange};
  std::vector<VkDeviceSize> offsets{0};
  for (const ComputeBuffer& buffer : buffers) {
    assert(buffer.contents.empty() || buffer.contents.size() == buffer.bytes);
    check_limit(device, "bytes in a buffer", buffer.bytes, limit);
    offsets.push_back(offsets.back() + (buffer.bytes + kStride - 1) / kStride * kStride);
  }
  check_limit(device, "bytes in all of a job's buffers", offsets.back(),
              {"maxMemoryAllocationSize", device.physical().most_memory});
  return offsets;
}

std::size_t bytes_to_upload(const std::vector<ComputeBuffer>& buffers) {
  std::size_t bytes = 0;
  for (const ComputeBuffer& buffer : buffers) bytes += buffer.contents.size();
  return bytes;
}

}  // namespace

VulkanComputeJob::VulkanComputeJob(const VulkanDevice& device, const ComputeJob& job)
    : device_(device),
      job_(job),
      offsets_(offsets_of(device, job.buffers)),
      buffers_(make_device_buffer(device, offsets_.back(),
                                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT |
                                      VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                      VK_BUFFER_USAGE_TRANSFER_SRC_BIT)),
      dispatches_(make_host_buffer(device, job.passes.size() * kStride, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, 0)),
      stamps_(device, static_cast<std::uint32_t>(job.passes.size() + 2)),
      staged_(make_host_buffer(device, bytes_to_upload(job.buffers), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, 0)) {
  make_sets();
}

void VulkanComputeJob::make_sets() {
  std::map<VkDescriptorType, std::uint32_t> counts;
  std::vector<VkDescriptorSetLayout> layouts;
  for (const ComputePass& pass : job_.passes) {
    for (const VkDescriptorType type : pipeline_of(pass).bindings()) ++counts[type];
    layouts.push_back(pipeline_of(pass).set_layout());
  }
  std::vector<VkDescriptorPoolSize> sizes;
  sizes.reserve(counts.size());
  for (const auto& [type, count] : counts) sizes.push_back({.type = type, .descriptorCount = count});
  const VkDescriptorPoolCreateInfo pool_info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                             .maxSets = static_cast<std::uint32_t>(layouts.size()),
                                             .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
                                             .pPoolSizes = sizes.data()};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateDescriptorPool(device_.handle(), &pool_info, nullptr, &pool),
           "vkCreateDescriptorPool");
  pool_ = {device_.logical(), pool};
  const VkDescriptorSetAllocateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                         .descriptorPool = pool,
                                         .descriptorSetCount = static_cast<std::uint32_t>(layouts.size()),
                                         .pSetLayouts = layouts.data()};
  sets_.resize(layouts.size());
  vk_check(device_.calls().vkAllocateDescriptorSets(device_.handle(), &info, sets_.data()), "vkAllocateDescriptorSets");
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    const ComputePass& pass = job_.passes[i];
    assert(pipeline_of(pass).bindings().size() == kFirstBufferBinding + pass.buffers.size());
    bind(sets_[i], kDispatchBinding, pipeline_of(pass),
         {.buffer = dispatches_.buffer.get(), .offset = i * kStride, .range = kStride});
    int binding = kFirstBufferBinding;
    for (const int place : pass.buffers) {
      const auto buffer = static_cast<std::size_t>(place);
      bind(sets_[i], binding++, pipeline_of(pass),
           {.buffer = buffers_.buffer.get(), .offset = offsets_[buffer], .range = job_.buffers[buffer].bytes});
    }
  }
}

void VulkanComputeJob::bind(VkDescriptorSet set, int binding, const VulkanCompute& pipeline,
                            const VkDescriptorBufferInfo& buffer) {
  VkWriteDescriptorSet written{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                               .dstSet = set,
                               .dstBinding = static_cast<std::uint32_t>(binding),
                               .descriptorCount = 1,
                               .descriptorType = pipeline.bindings()[static_cast<std::size_t>(binding)],
                               .pBufferInfo = &buffer};
  VkBufferView view = VK_NULL_HANDLE;
  if (written.descriptorType == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER) {
    view = texel_view(buffer);
    written.pTexelBufferView = &view;
  }
  device_.calls().vkUpdateDescriptorSets(device_.handle(), 1, &written, 0, nullptr);
}

VkBufferView VulkanComputeJob::texel_view(const VkDescriptorBufferInfo& buffer) {
  check_limit(device_, "texels in a buffer", buffer.range / kBufferTexelBytes,
              {"maxTexelBufferElements", device_.physical().properties.limits.maxTexelBufferElements});
  const VkBufferViewCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                    .buffer = buffer.buffer,
                                    .format = VK_FORMAT_R32G32B32A32_SFLOAT,
                                    .offset = buffer.offset,
                                    .range = buffer.range};
  VkBufferView view = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateBufferView(device_.handle(), &info, nullptr, &view), "vkCreateBufferView");
  views_.emplace_back(device_.logical(), view);
  return view;
}

VkCommandBuffer VulkanComputeJob::commands() {
  if (!recording_) recording_.emplace(device_, VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT);
  return recording_->handle();
}

void VulkanComputeJob::begin_part(std::string_view part) {
  if (is_in_part_ && parts_.back() == part) return;
  end_part();
  parts_.push_back(part);
  is_in_part_ = true;
  if (stamps_.available()) stamps_.record_start(commands(), static_cast<std::uint32_t>(parts_.size() - 1));
}

void VulkanComputeJob::end_part() {
  if (!is_in_part_) return;
  is_in_part_ = false;
  if (stamps_.available()) stamps_.record_end(commands(), static_cast<std::uint32_t>(parts_.size() - 1));
}

void VulkanComputeJob::submit() {
  if (!recording_) return;
  end_part();
  const VkCommandBuffer recorded = recording_->end();
  device_.run({&recorded, 1});
  recording_.reset();
  for (std::size_t i = 0; i < parts_.size() && stamps_.available(); ++i)
    add_time(times_, parts_[i], stamps_.elapsed_ns(static_cast<std::uint32_t>(i)));
  parts_.clear();
}

void VulkanComputeJob::upload() {
  begin_part("upload");
  std::vector<VkBufferCopy> copies;
  VkDeviceSize staged = 0;
  for (std::size_t i = 0; i < job_.buffers.size(); ++i) {
    const std::span<const std::byte> bytes = job_.buffers[i].contents;
    if (bytes.empty()) continue;
    std::ranges::copy(bytes, staged_.bytes.begin() + static_cast<std::ptrdiff_t>(staged));
    copies.push_back({.srcOffset = staged, .dstOffset = offsets_[i], .size = bytes.size()});
    staged += bytes.size();
  }
  device_.calls().vkCmdCopyBuffer(commands(), staged_.buffer.get(), buffers_.buffer.get(),
                                  static_cast<std::uint32_t>(copies.size()), copies.data());
  barrier(device_, commands(), kCopied, kComputing);
}

void VulkanComputeJob::dispatch(std::size_t pass, int first_row, int rows) {
  const ComputePass& what = job_.passes[pass];
  const VulkanCompute& pipeline = pipeline_of(what);
  // Written before the submit that reads it, which makes it visible; no earlier one reads it any more.
  const std::array<int, 2> values{first_row, what.argument};
  std::memcpy(dispatches_.bytes.data() + pass * kStride, values.data(), sizeof values);
  begin_part(what.part);
  const VolkDeviceTable& vk = device_.calls();
  barrier(device_, commands(), kComputed, kComputing);
  vk.vkCmdBindPipeline(commands(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.handle());
  vk.vkCmdBindDescriptorSets(commands(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout(), 0, 1, &sets_[pass], 0,
                             nullptr);
  vk.vkCmdDispatch(commands(), static_cast<std::uint32_t>(what.groups_x), static_cast<std::uint32_t>(rows),
                   static_cast<std::uint32_t>(what.groups_z));
}

void VulkanComputeJob::run(std::size_t pass) {
  const ComputePass& what = job_.passes[pass];
  if (!what.may_be_long) {
    dispatch(pass, 0, what.groups_y);
    return;
  }
  submit();
  run_in_bands(what.groups_y, [&](int first, int count) {
    dispatch(pass, first, count);
    submit();
    if (job_.on_progress) job_.on_progress();
  });
}

std::vector<std::byte> VulkanComputeJob::read_back() {
  const auto result = static_cast<std::size_t>(job_.result);
  const std::size_t bytes = job_.buffers[result].bytes;
  const HostBuffer staging =
      make_host_buffer(device_, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  begin_part("read_back");
  barrier(device_, commands(), kComputed, kCopying);
  const VkBufferCopy all{.srcOffset = offsets_[result], .size = bytes};
  device_.calls().vkCmdCopyBuffer(commands(), buffers_.buffer.get(), staging.buffer.get(), 1, &all);
  barrier(device_, commands(), kCopied, kRead);
  submit();
  return {staging.bytes.begin(), staging.bytes.end()};
}

ComputeResult VulkanComputeJob::run() {
  upload();
  for (std::size_t pass = 0; pass < job_.passes.size(); ++pass) run(pass);
  std::vector<std::byte> bytes = read_back();
  return {.bytes = std::move(bytes), .times = std::move(times_)};
}

}  // namespace reliefbench
