#include "kernels/judge/picture_metrics.h"

#include <cassert>
#include <cstdlib>

namespace reliefbench {
namespace {

bool has_ray(const PixelScore& pixel) { return pixel.verdict != Verdict::no_ray; }

}  // namespace

std::optional<double> masked_mean(std::span<const float> map, std::span<const PixelScore> mask) {
  assert(map.size() == mask.size());
  double sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (!has_ray(mask[i])) continue;
    sum += static_cast<double>(map[i]);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<double>(count);
}

std::optional<double> flicker(const FlickerFrame& before, const FlickerFrame& now) {
  assert(before.picture.size() == now.picture.size() && now.picture.size() == 4 * now.mask.size());
  const auto error = [](const FlickerFrame& frame, std::size_t i) { return frame.picture[i] - frame.reference[i]; };
  std::int64_t sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < now.mask.size(); ++i) {
    if (!has_ray(before.mask[i]) || !has_ray(now.mask[i])) continue;
    for (std::size_t c = 4 * i; c < 4 * i + 3; ++c) sum += std::abs(error(now, c) - error(before, c));
    count += 3;
  }
  if (count == 0) return std::nullopt;
  return static_cast<double>(sum) / static_cast<double>(count) / 255;
}

}  // namespace reliefbench
