#include "backends/backend.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/suggest.h"

namespace reliefbench {

std::string_view timer_id(Timer timer) {
  switch (timer) {
    case Timer::fenced_wall:
      return "fenced_wall";
    case Timer::gl_time_elapsed:
      return "gl_time_elapsed";
    case Timer::gl_timestamp:
      return "gl_timestamp";
    case Timer::vk_timestamp:
      return "vk_timestamp";
  }
  return "?";
}

std::string DeviceInfo::refusal(TexelType type) const {
  if (!is_of_blocks(type) || std::ranges::find(blocks, type) != blocks.end()) return "";
  return fmt::format("{}: {} takes no textures of {}", backend, name, texel_type_id(type));
}

std::span<const BackendRow> backends() {
  static const std::array rows = {
      BackendRow{.id = "opengl",
                 .description = "OpenGL 4.5 through EGL, headless",
                 .dialect = Dialect::opengl,
                 .real = true,
                 .devices = opengl_devices,
                 .open = open_opengl},
      BackendRow{.id = "vulkan",
                 .description = "Vulkan 1.2 or later, headless",
                 .dialect = Dialect::vulkan,
                 .real = true,
                 .devices = vulkan_devices,
                 .open = open_vulkan},
      BackendRow{.id = "null",
                 .description = "no GPU: made-up times and hits, the same in every run (for tests)",
                 .dialect = Dialect::vulkan,
                 .real = false,
                 .devices = null_devices,
                 .open = open_null},
  };
  return rows;
}

const BackendRow& find_backend(std::string_view id) { return find_row(backends(), "backend", id); }

std::size_t level_bytes(const TextureDesc& desc, int level) {
  return level_bytes(desc.layout, level_side(desc.width, level), level_side(desc.height, level));
}

std::size_t texture_bytes(const TextureDesc& desc) {
  std::size_t bytes = 0;
  for (int level = 0; level < desc.levels; ++level) bytes += level_bytes(desc, level);
  return bytes;
}

TextureDesc texture_desc(const TextureImage& image, Wrap wrap) {
  return {.width = image.width,
          .height = image.height,
          .layout = image.layout,
          .levels = image.levels,
          .texels = image.texels,
          .wrap = wrap};
}

Target color_target(std::span<const PixelFeature> features, bool has_depth) {
  Target target = Target::color;
  const auto has_objects = [](const PixelFeature& one) { return shows_in_objects(*one.feature); };
  target.has_depth = has_depth || std::ranges::any_of(features, has_objects);
  return target;
}

Target score_target(std::span<const PixelFeature> features, bool has_depth) {
  Target target = Target::score;
  target.has_depth = has_depth;
  for (const PixelFeature& one : with_values(features))
    target.attachments.push_back(
        {.name = one.feature->value->output, .layout = {.type = TexelType::float32, .channels = 1}});
  return target;
}

bool is_score(const Target& target) {
  return !target.attachments.empty() && target.attachments.front() == Target::score.attachments.front();
}

DeviceState Backend::state() {
  if (!state_source_) state_source_ = [watch = std::make_shared<DeviceWatch>(device())] { return watch->read(); };
  return state_source_();
}

void Backend::read_color(std::vector<std::uint8_t>& into) {
  const std::span<const std::uint8_t> bytes = read(Target::color.attachments[0].name);
  into.resize(bytes.size());
  for_each_share(bytes.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    std::memcpy(into.data() + first, bytes.data() + first, size);
  });
}

std::vector<std::uint8_t> Backend::read_color() {
  std::vector<std::uint8_t> rgba8;
  read_color(rgba8);
  return rgba8;
}

void Backend::read_score(std::vector<ScorePixel>& into) {
  constexpr std::size_t kHalf = sizeof(ScorePixel) / 2;  // of a pixel, in each attachment
  for (std::size_t half = 0; half < 2; ++half) {
    const std::span<const std::uint8_t> bytes = read(Target::score.attachments[half].name);
    into.resize(bytes.size() / kHalf);
    auto* const to = reinterpret_cast<std::uint8_t*>(into.data()) + half * kHalf;
    for_each_share(into.size(), [&](std::size_t, std::size_t first, std::size_t size) {
      for (std::size_t i = first; i < first + size; ++i)
        std::memcpy(to + i * sizeof(ScorePixel), bytes.data() + i * kHalf, kHalf);
    });
  }
}

FeatureValues Backend::read_values(std::span<const PixelFeature> features) {
  FeatureValues values;
  for (const PixelFeature& one : features) {
    const std::span<const std::uint8_t> bytes = read(one.feature->value->output);
    values.emplace_back(bytes.size() / sizeof(float));
    std::memcpy(values.back().data(), bytes.data(), bytes.size());
  }
  return values;
}

std::vector<ScorePixel> Backend::read_score() {
  std::vector<ScorePixel> pixels;
  read_score(pixels);
  return pixels;
}

const Texture& texture_of(const Draw& draw, std::string_view sampler) {
  const auto found = draw.textures.find(sampler);
  if (found == draw.textures.end() || found->second == nullptr)
    fail_environment("the shader reads `{}`, for which the draw has no texture", sampler);
  return *found->second;
}

std::array<std::uint32_t, 2> groups_of(const ShaderInterface& shader, const FrameUniforms& frame) {
  const auto groups = [&](std::size_t axis) {
    const auto pixels = static_cast<std::uint32_t>(frame.sizes[axis]);
    return (pixels + shader.group[axis] - 1) / shader.group[axis];
  };
  return {groups(0), groups(1)};
}

namespace {

void check_images(const ShaderInterface& shader, const Target& target, std::string_view label) {
  if (target.has_depth) fail_environment("{}: no compute shader has depth", label);
  if (shader.group[0] < 1 || shader.group[1] < 1) fail_environment("{}: its shader is no compute shader", label);
  for (const Attachment& attachment : target.attachments)
    if (std::ranges::find(shader.images, attachment.name, &ShaderVariable::name) == shader.images.end())
      fail_environment("{}: the compute shader has no image `{}`, which its target has", label, attachment.name);
  if (shader.images.size() > target.attachments.size())
    fail_environment("{}: the compute shader has {} images, its target {}", label, shader.images.size(),
                     target.attachments.size());
}

void check_outputs(const ShaderInterface& shader, const Target& target, std::string_view label) {
  for (std::size_t i = 0; i < target.attachments.size(); ++i) {
    const ShaderVariable wanted{.name = std::string(target.attachments[i].name),
                                .place = static_cast<std::uint32_t>(i)};
    if (std::ranges::find(shader.outputs, wanted) == shader.outputs.end())
      fail_environment("{}: the fragment shader has no output `{}` at location {}, which its target has", label,
                       wanted.name, i);
  }
  if (shader.outputs.size() > target.attachments.size())
    fail_environment("{}: the fragment shader writes {} outputs, its target has {}", label, shader.outputs.size(),
                     target.attachments.size());
}

}  // namespace

ShaderInterface interface_of(const PipelineDesc& desc) {
  if (desc.target.by_compute) {
    ShaderInterface shader = reflect(desc.fragment);
    check_images(shader, desc.target, desc.label);
    return shader;
  }
  ShaderInterface shader = joined(reflect(desc.vertex), reflect(desc.fragment));
  check_outputs(shader, desc.target, desc.label);
  return shader;
}

void fail_not_drawn(std::string_view backend, std::string_view attachment) {
  fail_environment("{}: no frame with the attachment {} was drawn", backend, attachment);
}

}  // namespace reliefbench
