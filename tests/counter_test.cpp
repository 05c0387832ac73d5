// Differences of counters that wrap round.
#include "backends/counter.h"

#include <gtest/gtest.h>

#include <limits>

namespace reliefbench {
namespace {

TEST(Counter, wraps_round_after_its_bits) {
  for (const int bits : {30, 36, 48, 63, 64}) {
    SCOPED_TRACE(bits);
    const std::uint64_t last = std::numeric_limits<std::uint64_t>::max() >> (64 - bits);
    EXPECT_EQ(counter_span(1000, 4000, bits), 3000);
    EXPECT_EQ(counter_span(last - 999, 2000, bits), 3000);
    EXPECT_EQ(counter_ticks(last - 999, 2000, bits), 3000U);
    EXPECT_EQ(counter_span(5, 5, bits), 0);
  }
}

TEST(Counter, stamps_out_of_order_are_so_across_the_wrap_too) {
  for (const int bits : {30, 36, 64}) {
    SCOPED_TRACE(bits);
    const std::uint64_t last = std::numeric_limits<std::uint64_t>::max() >> (64 - bits);
    EXPECT_EQ(counter_span(4000, 1000, bits), -3000);
    EXPECT_EQ(counter_span(2000, last - 999, bits), -3000);
  }
}

TEST(Counter, what_is_longer_than_half_of_its_range_is_told_by_its_ticks_alone) {
  constexpr std::uint64_t kLong = 600'000'000;  // of 2^30
  EXPECT_EQ(counter_ticks(100, 100 + kLong, 30), kLong);
  EXPECT_LT(counter_span(100, 100 + kLong, 30), 0);
}

TEST(Counter, bits_above_its_own_do_not_count) {
  constexpr std::uint64_t kAbove = std::uint64_t{7} << 36U;
  EXPECT_EQ(counter_span(kAbove + 10, 25, 36), 15);
  EXPECT_EQ(counter_span(10, kAbove + 25, 36), 15);
}

}  // namespace
}  // namespace reliefbench
