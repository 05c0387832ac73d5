#include "backends/vulkan/vulkan_bindings.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "backends/vulkan/vulkan_pipeline.h"
#include "backends/vulkan/vulkan_texture.h"

namespace reliefbench {
namespace {

const ShaderInterface& shader_of(const Draw& draw) { return own<VulkanPipeline>(draw.pipeline, "pipeline").shader; }

}  // namespace

void Bindings::make_room(std::size_t draws) {
  const std::size_t alignment = device_.physical().properties.limits.minUniformBufferOffsetAlignment;
  stride_ = (sizeof(FrameUniforms) + alignment - 1) / alignment * alignment;
  if (uniforms_.bytes.size() >= draws * stride_) return;
  // Where host-visible device memory exists, shaders need not read over the bus.
  uniforms_ = make_host_buffer(device_, draws * stride_, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                               VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
}

void Bindings::make_pool(std::span<const Draw> frame) {
  std::uint32_t blocks = 0;
  std::uint32_t samplers = 0;
  std::uint32_t images = 0;
  for (const Draw& draw : frame) {
    blocks += static_cast<std::uint32_t>(shader_of(draw).uniform_blocks.size());
    samplers += static_cast<std::uint32_t>(shader_of(draw).samplers.size());
    images += static_cast<std::uint32_t>(shader_of(draw).images.size());
  }
  pool_ = {};
  std::vector<VkDescriptorPoolSize> sizes;
  if (blocks > 0) sizes.push_back({.type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, .descriptorCount = blocks});
  if (samplers > 0) sizes.push_back({.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, .descriptorCount = samplers});
  if (images > 0) sizes.push_back({.type = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, .descriptorCount = images});
  if (sizes.empty()) return;
  const VkDescriptorPoolCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                        .maxSets = static_cast<std::uint32_t>(frame.size()),
                                        .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
                                        .pPoolSizes = sizes.data()};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_check(device_.calls().vkCreateDescriptorPool(device_.handle(), &info, nullptr, &pool), "vkCreateDescriptorPool");
  pool_ = {device_.logical(), pool};
}

VkDescriptorSet Bindings::make_set(const Draw& draw, std::size_t index, const VulkanTarget& target) {
  const ShaderInterface& shader = shader_of(draw);
  if (shader.samplers.empty() && shader.uniform_blocks.empty() && shader.images.empty()) return VK_NULL_HANDLE;
  VkDescriptorSet set = allocate_set(device_, pool_.get(), own<VulkanPipeline>(draw.pipeline, "pipeline"));

  const VkDescriptorBufferInfo uniforms{
      .buffer = uniforms_.buffer.get(), .offset = index * stride_, .range = sizeof(FrameUniforms)};
  std::vector<VkDescriptorImageInfo> images;
  images.reserve(shader.samplers.size() + shader.images.size());  // the writes point into it
  std::vector<VkWriteDescriptorSet> writes;
  const auto add = [&](std::uint32_t binding, VkDescriptorType type) -> VkWriteDescriptorSet& {
    return writes.emplace_back(VkWriteDescriptorSet{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                                    .dstSet = set,
                                                    .dstBinding = binding,
                                                    .descriptorCount = 1,
                                                    .descriptorType = type});
  };
  for (const ShaderVariable& block : shader.uniform_blocks)
    add(block.place, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER).pBufferInfo = &uniforms;
  for (const ShaderVariable& sampler : shader.samplers) {
    const auto& texture = own<VulkanTexture>(&texture_of(draw, sampler.name), sampler.name);
    images.push_back(
        {.sampler = texture.sampler.get(), .imageView = texture.image.view.get(), .imageLayout = kSampled.layout});
    add(sampler.place, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER).pImageInfo = &images.back();
  }
  for (const ShaderVariable& image : shader.images) {
    const auto place =
        std::ranges::find(target.target.attachments, image.name, &Attachment::name) - target.target.attachments.begin();
    images.push_back(
        {.imageView = target.images[static_cast<std::size_t>(place)].view.get(), .imageLayout = kStored.layout});
    add(image.place, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE).pImageInfo = &images.back();
  }
  device_.calls().vkUpdateDescriptorSets(device_.handle(), static_cast<std::uint32_t>(writes.size()), writes.data(), 0,
                                         nullptr);
  return set;
}

void Bindings::write(std::span<const Draw> frame, const VulkanTarget& target) {
  make_room(frame.size());
  make_pool(frame);
  sets_.clear();
  for (std::size_t i = 0; i < frame.size(); ++i) {
    std::memcpy(uniforms_.bytes.data() + i * stride_, &frame[i].frame, sizeof(FrameUniforms));
    sets_.push_back(make_set(frame[i], i, target));
  }
}

}  // namespace reliefbench
