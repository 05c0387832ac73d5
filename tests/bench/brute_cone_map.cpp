#include "tests/bench/brute_cone_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/brute_cone_map.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace reliefbench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The targets as one row of owners sees them: of row j those to the left, on the same column, and to the right.
struct Targets {
  const float* left;
  const float* middle;
  const float* right;
};

/// One row of texels; each target is met by a full vector of them.
template <bool kSided, class TargetsOf>
void brute_row(const Heightfield& heights, int y, const TargetsOf& targets_of, float* ratios) {
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
      const Targets targets = targets_of(j);
      for (int i = 0; i < side; ++i) {
        const auto middle = hn::Set(d, static_cast<double>(targets.middle[i]));
        const auto target_x = hn::Set(d, static_cast<double>(i));
        const auto lower = [&](auto x_lane, auto height, auto key) {
          const auto dx = hn::Sub(target_x, x_lane);
          auto top = middle;
          if constexpr (kSided) {
            top = hn::IfThenElse(hn::Gt(dx, zero), hn::Set(d, static_cast<double>(targets.right[i])), top);
            top = hn::IfThenElse(hn::Lt(dx, zero), hn::Set(d, static_cast<double>(targets.left[i])), top);
          }
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

void brute_conservative_row(const Heightfield& heights, int y, float* ratios) {
  const auto targets_of = [&](int j) {
    const float* const row = &heights.texels[static_cast<std::size_t>(j) * heights.width];
    return Targets{.left = row, .middle = row, .right = row};
  };
  brute_row<false>(heights, y, targets_of, ratios);
}

void brute_relaxed_row(const Heightfield& heights, const LimitingHeights& limiting, int y, float* ratios) {
  const auto targets_of = [&](int j) {
    // 0: up, 1: down, 2: level, where either counts.
    const std::size_t vertical = j < y ? 0 : j > y ? 1 : 2;
    const auto row = [&](std::size_t horizontal) {
      return &limiting[vertical][horizontal][static_cast<std::size_t>(j) * heights.width];
    };
    return Targets{.left = row(0), .middle = row(2), .right = row(1)};
  };
  brute_row<true>(heights, y, targets_of, ratios);
}

}  // namespace HWY_NAMESPACE
}  // namespace reliefbench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace reliefbench {
HWY_EXPORT(brute_conservative_row);
HWY_EXPORT(brute_relaxed_row);

std::vector<float> brute_cone_map(const Heightfield& heights) {
  std::vector<float> ratios(heights.texels.size());
  for (int y = 0; y < heights.height; ++y) {
    HWY_DYNAMIC_DISPATCH(brute_conservative_row)(heights, y, &ratios[static_cast<std::size_t>(y) * heights.width]);
  }
  return ratios;
}

std::vector<float> brute_relaxed_map(const Heightfield& heights) {
  LimitingHeights limiting;
  for (auto& rows : limiting) rows.fill(std::vector<float>(heights.texels.size(), -1));
  for (int y = 0; y < heights.height; ++y) {
    for (int x = 0; x < heights.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * heights.width + static_cast<std::size_t>(x);
      for (const std::size_t vertical : {0U, 1U}) {
        for (const std::size_t horizontal : {0U, 1U}) {
          const int next_x = wrapped(x + (horizontal == 1 ? 1 : -1), heights.width, Wrap::clamp);
          const int next_y = wrapped(y + (vertical == 1 ? 1 : -1), heights.height, Wrap::clamp);
          const float across = heights.at(next_x, y);
          const float along = heights.at(x, next_y);
          const float far = heights.at(next_x, next_y);
          const float height = heights.texels[i];
          if (height <= across && height <= along && across <= far && along <= far) continue;
          for (const std::size_t v : {vertical, std::size_t{2}}) {
            for (const std::size_t h : {horizontal, std::size_t{2}}) limiting[v][h][i] = height;
          }
        }
      }
    }
  }
  std::vector<float> ratios(heights.texels.size());
  for (int y = 0; y < heights.height; ++y) {
    HWY_DYNAMIC_DISPATCH(brute_relaxed_row)(heights, limiting, y, &ratios[static_cast<std::size_t>(y) * heights.width]);
  }
  return ratios;
}

}  // namespace reliefbench
#endif
