#include "backends/vulkan/vulkan_texture.h"

#include <cstring>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

VkFormat vulkan_format(const TexelLayout& texel) {
  const auto pick = [&](VkFormat one, VkFormat two, VkFormat four) {
    return texel.channels == 1 ? one : (texel.channels == 2 ? two : four);
  };
  switch (texel.type) {
    case TexelType::unorm8:
      return pick(VK_FORMAT_R8_UNORM, VK_FORMAT_R8G8_UNORM, VK_FORMAT_R8G8B8A8_UNORM);
    case TexelType::unorm16:
      return pick(VK_FORMAT_R16_UNORM, VK_FORMAT_R16G16_UNORM, VK_FORMAT_R16G16B16A16_UNORM);
    case TexelType::float16:
      return pick(VK_FORMAT_R16_SFLOAT, VK_FORMAT_R16G16_SFLOAT, VK_FORMAT_R16G16B16A16_SFLOAT);
    case TexelType::float32:
      return pick(VK_FORMAT_R32_SFLOAT, VK_FORMAT_R32G32_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT);
  }
  return VK_FORMAT_UNDEFINED;
}

VkSampler make_sampler(const VulkanDevice& device, const TextureDesc& desc) {
  const VkFilter filter = desc.filter == Filter::linear ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
  const VkSamplerAddressMode wrap =
      desc.wrap == Wrap::repeat ? VK_SAMPLER_ADDRESS_MODE_REPEAT : VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  const VkSamplerCreateInfo info{.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
                                 .magFilter = filter,
                                 .minFilter = filter,
                                 .mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST,
                                 .addressModeU = wrap,
                                 .addressModeV = wrap,
                                 .addressModeW = wrap,
                                 .maxLod = static_cast<float>(desc.levels - 1)};
  VkSampler sampler = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateSampler(device.handle(), &info, nullptr, &sampler), "vkCreateSampler");
  return sampler;
}

}  // namespace

std::unique_ptr<VulkanTexture> make_texture(const VulkanDevice& device, const TextureDesc& desc) {
  const std::string format_id = fmt::format("{} x {}", desc.layout.channels, texel_type_id(desc.layout.type));
  if (desc.width < 1 || desc.height < 1 || desc.texels.size() != texture_bytes(desc)) {
    fail_environment("vulkan: {} bytes are not a {}x{} texture of format {}", desc.texels.size(), desc.width,
                     desc.height, format_id);
  }
  VkFormatFeatureFlags features = VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  if (desc.filter == Filter::linear) features |= VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
  auto texture = std::make_unique<VulkanTexture>();
  texture->image = make_device_image(device, {.extent = {.width = static_cast<std::uint32_t>(desc.width),
                                                         .height = static_cast<std::uint32_t>(desc.height)},
                                              .format = vulkan_format(desc.layout),
                                              .format_id = format_id,
                                              .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                              .features = features,
                                              .levels = static_cast<std::uint32_t>(desc.levels)});
  texture->sampler = {device.logical(), make_sampler(device, desc)};
  upload_texels(device, texture->image, desc.texels);
  return texture;
}

Bindings::Bindings(const VulkanDevice& device, VkDescriptorSetLayout layout)
    : device_(device),
      // Where host-visible device memory exists, shaders need not read over the bus.
      uniforms_(make_host_buffer(device, sizeof(FrameUniforms), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                                 VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)) {
  const std::array sizes = {
      VkDescriptorPoolSize{.type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, .descriptorCount = 1},
      VkDescriptorPoolSize{.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, .descriptorCount = kTextures}};
  const VkDescriptorPoolCreateInfo pool_info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                             .maxSets = 1,
                                             .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
                                             .pPoolSizes = sizes.data()};
  VkDescriptorPool pool = VK_NULL_HANDLE;
  vk_check(device.calls().vkCreateDescriptorPool(device.handle(), &pool_info, nullptr, &pool),
           "vkCreateDescriptorPool");
  pool_ = {device.logical(), pool};
  const VkDescriptorSetAllocateInfo set_info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                             .descriptorPool = pool,
                                             .descriptorSetCount = 1,
                                             .pSetLayouts = &layout};
  vk_check(device.calls().vkAllocateDescriptorSets(device.handle(), &set_info, &set_), "vkAllocateDescriptorSets");
}

void Bindings::write(const FrameUniforms& frame, const std::array<const VulkanTexture*, kTextures>& textures) {
  std::memcpy(uniforms_.bytes.data(), &frame, sizeof frame);
  const VkDescriptorBufferInfo buffer{.buffer = uniforms_.buffer.get(), .range = sizeof frame};
  std::array<VkDescriptorImageInfo, kTextures> images{};
  std::array<VkWriteDescriptorSet, kTextures + 1> writes{};
  writes[0] = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
               .dstSet = set_,
               .dstBinding = kFrameBinding,
               .descriptorCount = 1,
               .descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
               .pBufferInfo = &buffer};
  for (std::size_t i = 0; i < textures.size(); ++i) {
    images[i] = {.sampler = textures[i]->sampler.get(),
                 .imageView = textures[i]->image.view.get(),
                 .imageLayout = kSampled.layout};
    writes[i + 1] = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                     .dstSet = set_,
                     .dstBinding = kReliefBinding + static_cast<std::uint32_t>(i),
                     .descriptorCount = 1,
                     .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
                     .pImageInfo = &images[i]};
  }
  device_.calls().vkUpdateDescriptorSets(device_.handle(), static_cast<std::uint32_t>(writes.size()), writes.data(), 0,
                                         nullptr);
}

}  // namespace reliefbench
