#include "tuner/decide/choose.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/hand_made.h"
#include "tuner/plan/setting_space.h"
#include "tuner/tune/tune_search.h"

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
  Record old = binary;  // from before `loop` was a parameter
  std::erase_if(old.params, [](const auto& param) { return param.first == "loop"; });
  EXPECT_EQ(simplicity(old), simplicity(binary));
  Record unknown = relief;
  unknown.technique = "telepathy";
  EXPECT_ANY_THROW((void)simplicity(unknown));
}

/// A search of two settings that meet the budgets: a plain relief trace, and one with a refinement that is 1 % faster
/// by estimate.
struct TwoSettings {
  SearchSpace space = empty_setting_space();
  SearchResult search;
  TuneQuestion question{.max_error = {{"e_xy.p99", 0.5}}, .epsilon = 0.06};
  std::int64_t plain_bytes = 64;

  TwoSettings() {
    for (const char* refinement : {"none", "binary"}) {
      Settings settings(find_technique("relief"));
      settings.set("refinement", refinement);
      space.candidates.push_back(candidate_of(settings, setting_id(settings)));
    }
    const auto measured = [](double low_ns, double time_ns, double high_ns) {
      return CandidateState{
          .evidence = Evidence::measured, .samples = 9, .time_ns = time_ns, .low_ns = low_ns, .high_ns = high_ns};
    };
    search.states = {measured(99, 101, 103), measured(98, 100, 102)};
    search.answers = {
        {.max_error = 0, .pick = 1, .time_ns = 100, .high_ns = 102, .rival_low_ns = 99, .gap = 102.0 / 99 - 1}};
  }
  [[nodiscard]] TunePick pick() const {
    return *pick_of(search, space, question, std::nullopt, [&](std::size_t i) { return i == 0 ? plain_bytes : 64; });
  }
};

TEST(TunePick, of_settings_that_the_certificate_covers_alike_the_simplest_is_the_pick) {
  const TwoSettings two;
  const TunePick pick = two.pick();
  EXPECT_EQ(pick.setting, two.space.candidates[0].id);
  EXPECT_EQ(pick.tie, two.space.candidates[1].id);
  EXPECT_EQ(pick.time_ns, 101);
  EXPECT_NEAR(pick.gap, 103.0 / 98 - 1, 1e-12);  // to the least that any of them may take
}

TEST(TunePick, a_tie_never_costs_the_certificate) {
  TwoSettings two;
  two.question.epsilon = 0.04;  // the plain one may be 5.1 % slower than the best
  EXPECT_EQ(two.pick().setting, two.space.candidates[1].id);
  two.question.epsilon = 0.02;  // nothing is certified: the search's own answer
  EXPECT_EQ(two.pick().setting, two.space.candidates[1].id);
  EXPECT_EQ(two.pick().tie, "");
}

TEST(TunePick, a_tie_never_leaves_the_bound_on_time) {
  TwoSettings two;
  two.question.max_error.clear();
  two.question.max_time_ms = 102.5e-6;  // the plain one may take 103 ns
  EXPECT_EQ(two.pick().setting, two.space.candidates[1].id);
  EXPECT_EQ(two.pick().tie, "");
  two.question.max_time_ms = 103e-6;
  EXPECT_EQ(two.pick().setting, two.space.candidates[0].id);
}

TEST(TunePick, settings_that_time_tells_apart_do_not_tie) {
  TwoSettings two;
  two.search.states[0] = {
      .evidence = Evidence::measured, .samples = 9, .time_ns = 104, .low_ns = 102.5, .high_ns = 105};
  two.search.answers[0].rival_low_ns = 102.5;
  two.search.answers[0].gap = 0;
  two.question.epsilon = 0.1;
  EXPECT_EQ(two.pick().setting, two.space.candidates[1].id);
  EXPECT_EQ(two.pick().tie, "");
}

}  // namespace
}  // namespace reliefbench
