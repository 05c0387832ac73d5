#include "backends/filter_audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>

#include "backends/shader_compiler.h"
#include "kernels/base/error.h"
#include "kernels/maps/map_texture.h"

namespace reliefbench {
namespace {

constexpr int kSide_px = 128;  // filter.frag's
constexpr Attachment kShown{.name = "out_shown", .layout = {.type = TexelType::float32, .channels = 2}};
constexpr int kPlaces = 1 << kMostFilterBits;
static_assert(kSide_px * kSide_px == kPlaces);
constexpr double kFloatRounding = 0x1p-22;  // of a few operations on values up to 1

/// A plane of texels that are nearly alike, and exact: it rises by a step of 8 bits a texel, from the middle on.
/// A block of EAC, BC7 or ASTC that has 0 and 1, too, has three values in a row only so far apart.
float plane_step(TexelType type) {
  if (type == TexelType::eac) return 112.0F / 2047;
  if (type == TexelType::bc7) return 36.0F / 255;
  if (type == TexelType::astc) return 2048.0F / 65535;
  return is_float(type) ? 1.0F / 256 : 1.0F / 255;
}
float plane_low(TexelType type) {
  if (type == TexelType::eac) return 1044.0F / 2047;
  if (type == TexelType::bc7) return plane_step(type);
  return (type == TexelType::astc ? 10.0F : 128.0F) * plane_step(type);
}

/// filter.frag's: two texels, 0 and 1, and a cell of the plane.
TextureImage audited_texels(TexelType type) {
  const float step = plane_step(type);
  const float low = plane_low(type);
  return pack_heights(
             {.width = 4, .height = 2, .texels = {0.0F, 1.0F, low, low + step, 0.0F, 1.0F, low + step, low + 2 * step}},
             {.id = "audited", .type = type, .channels = 1})
      .relief;
}

FilterPrecision shown_precision(Backend& backend, const Pipeline& pipeline, const Texture& texture, TexelType type) {
  Draw draw{.pipeline = &pipeline, .textures = {{kReliefMap, &texture}}};
  draw.frame.sizes = {kSide_px, kSide_px, 4, 2};
  static_cast<void>(backend.render(draw, 1, Timer::fenced_wall));
  const std::span<const std::uint8_t> bytes = backend.read(kShown.name);
  std::vector<std::array<float, 2>> shown(kPlaces);
  std::memcpy(shown.data(), bytes.data(), bytes.size());
  std::vector<float> weights;
  std::vector<float> values;
  for (const auto& [weight, value] : shown) {
    weights.push_back(weight);
    values.push_back(value);
  }
  FilterPrecision precision = filter_precision(weights);
  precision.value = filter_value_error(values, plane_low(type), plane_step(type), precision.worst());
  return precision;
}

FilterAudit audit_type(Backend& backend, const Pipeline& pipeline, TexelType type) {
  const TextureImage texels = audited_texels(type);
  FilterAudit audit{.type = type};
  std::unique_ptr<Texture> texture;
  try {
    texture = backend.upload(texture_desc(texels, Wrap::clamp));
  } catch (const Error& error) {
    if (error.fault() != Fault::other) throw;
    audit.refusal = error.what();
    return audit;
  }
  audit.precision = shown_precision(backend, pipeline, *texture, type);
  return audit;
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

double filter_value_error(std::span<const float> values, double low, double step, double shift) {
  const auto side = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(values.size()))));
  double worst = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t row = i / side;
    const std::size_t column = i % side;
    const double way = static_cast<double>(row + column) / static_cast<double>(side);
    worst = std::max(worst, std::abs(static_cast<double>(values[i]) - (low + way * step)));
  }
  const double beyond = worst - 2 * shift * step;
  return beyond > kFloatRounding ? beyond : 0;
}

FilterError FilterPrecision::error() const { return {.shift = worst() + 1.0 / kPlaces, .value = value}; }

std::vector<FilterAudit> audit_filter(Backend& backend, Dialect dialect, const SimulatedFilter& simulated) {
  const Spirv vertex = compile_vertex(dialect);
  const Spirv fragment = compile_filter(dialect);
  const auto pipeline = backend.compile({.label = "filter",
                                         .vertex = vertex,
                                         .fragment = fragment,
                                         .constants = constants_of(nullptr, Wrap::clamp, {.simulated = simulated}),
                                         .target = {.attachments = {kShown}}});
  std::vector<FilterAudit> audits;
  for (const TexelType type : kTexelTypes)
    if (backend.device().takes(type)) audits.push_back(audit_type(backend, *pipeline, type));
  return audits;
}

}  // namespace reliefbench
