#include "kernels/judge/picture_metrics.h"

#include <cassert>
#include <cstdlib>

#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

struct Trembling {
  std::int64_t sum = 0;    // of |E - E_before|, in codes
  std::int64_t count = 0;  // of channels

  Trembling& operator+=(const Trembling& other) {
    sum += other.sum;
    count += other.count;
    return *this;
  }
};

}  // namespace

std::optional<double> flicker(const FlickerFrame& before, const FlickerFrame& now) {
  assert(before.picture.size() == now.picture.size() && now.picture.size() == 4 * now.mask.size());
  const auto error = [](const FlickerFrame& frame, std::size_t i) { return frame.picture[i] - frame.reference[i]; };
  const Trembling whole = sum_of_shares(now.mask.size(), [&](std::size_t first, std::size_t size) {
    Trembling share;
    for (std::size_t i = first; i < first + size; ++i) {
      if (!is_judged(before.mask[i]) || !is_judged(now.mask[i])) continue;
      for (std::size_t c = 4 * i; c < 4 * i + 3; ++c) share.sum += std::abs(error(now, c) - error(before, c));
      share.count += 3;
    }
    return share;
  });
  if (whole.count == 0) return std::nullopt;
  return static_cast<double>(whole.sum) / static_cast<double>(whole.count) / 255;
}

}  // namespace reliefbench
