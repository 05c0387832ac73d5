#include "backends/filter_audit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "backends/shader_compiler.h"
#include "kernels/maps/texel.h"

namespace reliefbench {
namespace {

constexpr int kSide_px = 128;  // filter.frag's
static_assert(kSide_px * kSide_px == 1 << kMostFilterBits);

/// Two texels, 0 and 1.
std::vector<std::byte> two_texels(const TexelLayout& layout) {
  const std::uint32_t one = nearest_code(1, layout.type);
  const auto bytes = static_cast<std::size_t>(layout.bytes());
  std::vector<std::byte> texels(2 * bytes);
  std::memcpy(texels.data() + bytes, &one, bytes);
  return texels;
}

std::vector<float> shown_weights(Backend& backend, const Pipeline& pipeline, TexelType type) {
  const TexelLayout layout{.type = type, .channels = 1};
  const std::vector<std::byte> texels = two_texels(layout);
  const auto texture = backend.upload(
      {.width = 2, .height = 1, .layout = layout, .texels = texels, .wrap = Wrap::clamp, .filter = Filter::linear});
  Draw draw{.pipeline = &pipeline, .textures = {{"two_texels", texture.get()}}};
  draw.frame.sizes = {kSide_px, kSide_px, 2, 1};
  static_cast<void>(backend.render(draw, 1, Timer::fenced_wall));
  const std::span<const std::uint8_t> bytes = backend.read("out_weight");
  std::vector<float> weights(bytes.size() / sizeof(float));
  std::memcpy(weights.data(), bytes.data(), bytes.size());
  return weights;
}

}  // namespace

FilterPrecision filter_precision(std::span<const float> weights) {
  const auto count = static_cast<double>(weights.size());
  FilterPrecision precision{.least = 1, .greatest = -1};
  // A step is where the weight has grown by more than what arithmetic on the same weight may differ by.
  const double least_step = 0.5 / count;
  int steps = 0;
  auto at = static_cast<double>(weights.front());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto shown = static_cast<double>(weights[i]);
    const double off = shown - static_cast<double>(i) / count;
    precision.least = std::min(precision.least, off);
    precision.greatest = std::max(precision.greatest, off);
    if (shown - at < least_step) continue;
    at = shown;
    ++steps;
  }
  precision.bits = steps == 0 ? 0 : static_cast<int>(std::lround(std::log2(steps)));
  // A filter that rounds is as far above as below; one that cuts off is never above.
  precision.rounds = precision.greatest > -precision.least / 2;
  return precision;
}

std::vector<FilterAudit> audit_filter(Backend& backend, Dialect dialect) {
  const Spirv vertex = compile_vertex(dialect);
  const Spirv fragment = compile_filter(dialect);
  const auto pipeline =
      backend.compile({.label = "filter",
                       .vertex = vertex,
                       .fragment = fragment,
                       .constants = {},
                       .target = {.attachments = {{"out_weight", {.type = TexelType::float32, .channels = 1}}}}});
  std::vector<FilterAudit> audits;
  for (const TexelType type : {TexelType::unorm8, TexelType::unorm16, TexelType::float16, TexelType::float32})
    audits.push_back({.type = type, .precision = filter_precision(shown_weights(backend, *pipeline, type))});
  return audits;
}

}  // namespace reliefbench
