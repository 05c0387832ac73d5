// The clock that orders a run's samples, where the wall clock was set back between two starts.
#include "tuner/measure/run_clock.h"

#include <gtest/gtest.h>

#include "tuner/results/store.h"

namespace reliefbench {
namespace {

Sample drawn_at(double at_ns) { return {.case_id = "a", .frames = 1, .frame_time_ns = 1, .at_ns = at_ns}; }

TEST(RunClock, goes_on_by_the_wall_clock) {
  EXPECT_EQ(goes_on_at_ns({}, 7e9), 7e9);
  EXPECT_EQ(goes_on_at_ns({}, -7e9), 0);
  reliefbench::Run earlier;
  earlier.samples = {drawn_at(1e9), drawn_at(2e9)};
  EXPECT_EQ(goes_on_at_ns(earlier, 7e9), 7e9);
}

TEST(RunClock, goes_on_after_what_was_drawn_where_the_wall_clock_was_set_back) {
  reliefbench::Run earlier;
  earlier.samples = {drawn_at(3e9), drawn_at(2e9)};
  EXPECT_EQ(goes_on_at_ns(earlier, -5e9), 3e9);
  earlier.blocks = {{.backend = "null", .from_ns = 3e9, .to_ns = 4e9}};  // held back: its samples are no longer there
  EXPECT_EQ(goes_on_at_ns(earlier, 1e9), 4e9);
}

TEST(RunClock, begins_where_it_is_told_and_never_goes_back) {
  const RunClock clock(4e9);
  double before_ns = 4e9;
  for (int i = 0; i < 1000; ++i) {
    const double now_ns = clock.now_ns();
    EXPECT_GE(now_ns, before_ns - 1e3);  // a double holds half a microsecond of a long uptime
    before_ns = now_ns;
  }
  EXPECT_LT(before_ns, 4e9 + 60e9);
}

}  // namespace
}  // namespace reliefbench
