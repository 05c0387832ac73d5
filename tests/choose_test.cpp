#include "tuner/decide/choose.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "tests/hand_made.h"

namespace reliefbench {
namespace {

Contender contender(double low_ns, double high_ns, std::size_t features = 0, std::int64_t memory_bytes = 0) {
  return {.simplicity = {.features = features}, .memory_bytes = memory_bytes, .low_ns = low_ns, .high_ns = high_ns};
}

TEST(Choose, takes_the_fastest_where_intervals_tell) {
  const Choice choice = choose(std::vector{contender(20, 21), contender(10, 11, 5, 1000), contender(12, 13)});
  EXPECT_EQ(choice.pick, 1U);
  EXPECT_FALSE(choice.tie.has_value());
  EXPECT_EQ(choice.ties, 0U);
}

// 3.01 ms in 256 KiB was picked over 2.68 ms in 64 KiB, whose interval overlapped and reached further.
TEST(Choose, takes_the_smaller_of_two_that_tie) {
  const Choice choice = choose(std::vector{contender(2.9, 3.1, 1, 256), contender(2.5, 3.3, 1, 64)});
  EXPECT_EQ(choice.pick, 1U);
  EXPECT_EQ(choice.tie, 0U);
  EXPECT_EQ(choice.ties, 1U);
}

TEST(Choose, features_count_before_memory_and_memory_before_the_technique) {
  EXPECT_EQ(choose(std::vector{contender(1, 2, 2, 10), contender(1, 3, 1, 99)}).pick, 1U);
  std::vector<Contender> same = {contender(1, 2, 1, 20), contender(1, 3, 1, 10)};
  same[1].simplicity.technique = 7;
  EXPECT_EQ(choose(same).pick, 1U);
  same[0].memory_bytes = 10;
  EXPECT_EQ(choose(same).pick, 0U);
  EXPECT_EQ(choose(std::vector{contender(1, 3), contender(1, 2)}).pick, 1U);
}

TEST(Choose, ties_are_with_the_fastest_and_not_passed_on) {
  // The third overlaps the second, which overlaps the first.
  const Choice choice = choose(std::vector{contender(1, 2, 3), contender(2, 3, 2), contender(3, 4, 0)});
  EXPECT_EQ(choice.pick, 1U);
  EXPECT_EQ(choice.tie, 0U);
}

RC_GTEST_PROP(Choose, NoTiedSettingRanksBeforeThePick, ()) {
  const auto numbers = *rc::gen::suchThat(rc::gen::container<std::vector<int>>(rc::gen::inRange(1, 40)),
                                          [](const auto& v) { return v.size() >= 4; });
  std::vector<Contender> all;
  for (std::size_t i = 0; i + 3 < numbers.size(); i += 4)
    all.push_back(contender(numbers[i], numbers[i] + numbers[i + 1], static_cast<std::size_t>(numbers[i + 2] % 4),
                            numbers[i + 3] % 5));
  const Choice choice = choose(all);
  double least_high = 1e9;
  for (const Contender& one : all) least_high = std::min(least_high, one.high_ns);
  RC_ASSERT(all[choice.pick].low_ns <= least_high);
  for (const Contender& one : all)
    if (one.low_ns <= least_high) RC_ASSERT(!(one.rank() < all[choice.pick].rank()));
  RC_ASSERT(choice.tie.has_value() == (choice.ties > 0));
}

TEST(Choose, fewer_features_are_simpler_then_an_earlier_technique) {
  const Record flat = make_record({.case_id = "flat", .technique = "flat"});
  const Record relief = make_record({.case_id = "relief", .params = {{"refinement", "none"}}});
  const Record binary = make_record({.case_id = "binary", .params = {{"refinement", "binary"}}});
  EXPECT_LT(simplicity(flat), simplicity(relief));
  EXPECT_LT(simplicity(relief), simplicity(binary));
  Record unknown = relief;
  unknown.technique = "telepathy";
  EXPECT_ANY_THROW((void)simplicity(unknown));
}

}  // namespace
}  // namespace reliefbench
