#include "backends/vulkan/vulkan_texture.h"

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

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
    case TexelType::rgtc:
      return pick(VK_FORMAT_BC4_UNORM_BLOCK, VK_FORMAT_BC5_UNORM_BLOCK, VK_FORMAT_UNDEFINED);
    case TexelType::eac:
      return pick(VK_FORMAT_EAC_R11_UNORM_BLOCK, VK_FORMAT_EAC_R11G11_UNORM_BLOCK, VK_FORMAT_UNDEFINED);
    case TexelType::bc7:
      return VK_FORMAT_BC7_UNORM_BLOCK;
    case TexelType::astc:
      return VK_FORMAT_ASTC_4x4_UNORM_BLOCK;
  }
  return VK_FORMAT_UNDEFINED;
}

std::unique_ptr<VulkanTexture> make_texture(const VulkanDevice& device, const TextureDesc& desc) {
  const std::string format_id = fmt::format("{} x {}", desc.layout.channels, texel_type_id(desc.layout.type));
  if (desc.width < 1 || desc.height < 1 || desc.texels.size() != texture_bytes(desc)) {
    fail_environment("vulkan: {} bytes are not a {}x{} texture of format {}", desc.texels.size(), desc.width,
                     desc.height, format_id);
  }
  for (const BlockFeature& block : kBlockFeatures)
    if (desc.layout.type == block.type && device.physical().features.*block.feature == VK_FALSE)
      fail_environment("vulkan: the device takes no textures of {} ({})", texel_type_id(block.type), block.id);
  VkFormatFeatureFlags features = VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT;
  if (desc.filter == Filter::linear) features |= VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
  auto texture = std::make_unique<VulkanTexture>();
  texture->image = make_device_image(device, {.extent = {.width = static_cast<std::uint32_t>(desc.width),
                                                         .height = static_cast<std::uint32_t>(desc.height)},
                                              .format = vulkan_format(desc.layout),
                                              .format_id = format_id,
                                              .texel_bytes = static_cast<std::size_t>(desc.layout.bytes()),
                                              .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                                              .features = features,
                                              .levels = static_cast<std::uint32_t>(desc.levels)});
  texture->sampler = {device.logical(), make_sampler(device, desc)};
  upload_texels(device, texture->image, desc.layout, desc.texels);
  return texture;
}

}  // namespace reliefbench
