#pragma once
#include <cstdint>
#include <limits>

namespace reliefbench {

/// Ticks from one stamp to a later one of a counter of so many bits (1 to 64), which may have wrapped round once
/// between them. What the stamps hold above those bits does not count.
[[nodiscard]] constexpr std::uint64_t counter_ticks(std::uint64_t from, std::uint64_t to, int bits) {
  return (to - from) & (std::numeric_limits<std::uint64_t>::max() >> (64 - bits));
}

/// The same, negative where the stamps come out of order: what is longer than half of the counter's range is taken so.
[[nodiscard]] constexpr std::int64_t counter_span(std::uint64_t from, std::uint64_t to, int bits) {
  const std::uint64_t back = counter_ticks(to, from, bits);
  const std::uint64_t ticks = counter_ticks(from, to, bits);
  return ticks <= back ? static_cast<std::int64_t>(ticks) : -static_cast<std::int64_t>(back);
}

}  // namespace reliefbench
