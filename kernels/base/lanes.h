#pragma once
#include <array>
#include <cstddef>

namespace reliefbench {

/// What take(lane, i) makes of eight lanes over i = 0 .. count - 1: none waits for the one before.
template <typename Lane, typename Take>
[[nodiscard]] std::array<Lane, 8> in_lanes(std::size_t count, const Take& take) {
  std::array<Lane, 8> lanes{};
  std::size_t i = 0;
  for (; i + lanes.size() <= count; i += lanes.size())
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) take(lanes[lane], i + lane);
  for (; i < count; ++i) take(lanes[0], i);
  return lanes;
}

}  // namespace reliefbench
