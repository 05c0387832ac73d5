#include "tests/bench/brute_cone_map.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/brute_cone_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// One row of texels; each target is met by a full vector of them.
void brute_row(const Heightfield& heights, int y, float* ratios) {
  const HWY_FULL(double) d;
  const std::size_t lanes = hn::Lanes(d);
  const int side = heights.width;
  const auto zero = hn::Zero(d);
  HWY_ALIGN double buffer[HWY_MAX_BYTES / sizeof(double)];
  // Two vectors of texels at once hide the division's latency.
  for (std::size_t x = 0; x < static_cast<std::size_t>(side); x += 2 * lanes) {
    const auto load = [&](std::size_t first) {
      for (std::size_t i = 0; i < lanes; ++i) {
        const int px = static_cast<int>(std::min(first + i, static_cast<std::size_t>(side) - 1));
        buffer[i] = heights.at(px, y);
      }
      return hn::Load(d, buffer);
    };
    const auto height_a = load(x);
    const auto height_b = load(x + lanes);
    const auto x_a = hn::Iota(d, static_cast<double>(x));
    const auto x_b = hn::Iota(d, static_cast<double>(x + lanes));
    auto key_a = hn::Set(d, static_cast<double>(side) * side);
    auto key_b = key_a;
    for (int j = 0; j < side; ++j) {
      const double dy = j - y;
      const auto dy2 = hn::Set(d, dy * dy);
      for (int i = 0; i < side; ++i) {
        const auto top = hn::Set(d, static_cast<double>(heights.at(i, j)));
        const auto target_x = hn::Set(d, static_cast<double>(i));
        const auto lower = [&](auto x_lane, auto height, auto key) {
          const auto dx = hn::Sub(x_lane, target_x);
          const auto rise = hn::Sub(top, height);
          const auto found = hn::Div(hn::Add(hn::Mul(dx, dx), dy2), hn::Mul(rise, rise));
          return hn::IfThenElse(hn::Gt(rise, zero), hn::Min(key, found), key);
        };
        key_a = lower(x_a, height_a, key_a);
        key_b = lower(x_b, height_b, key_b);
      }
    }
    const auto store = [&](std::size_t first, auto key) {
      hn::Store(hn::Sqrt(key), d, buffer);
      for (std::size_t i = 0; i < lanes && first + i < static_cast<std::size_t>(side); ++i) {
        const double exact = buffer[i] / side;
        const auto nearest = static_cast<float>(exact);
        ratios[first + i] = static_cast<double>(nearest) > exact ? std::nextafter(nearest, 0.0F) : nearest;
      }
    };
    store(x, key_a);
    store(x + lanes, key_b);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace reliefbench {
HWY_EXPORT(brute_row);

std::vector<float> brute_cone_map(const Heightfield& heights) {
  std::vector<float> ratios(heights.texels.size());
  for (int y = 0; y < heights.height; ++y) {
    HWY_DYNAMIC_DISPATCH(brute_row)(heights, y, &ratios[static_cast<std::size_t>(y) * heights.width]);
  }
  return ratios;
}

}  // namespace reliefbench
#endif
