// What a check makes of an event that it knows where it looks at fewer nights or otherwise, of two events that look
// alike, and of Google Benchmark's nights.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/looks.h"
#include "tests/made_history.h"
#include "tuner/decide/epochs.h"
#include "tuner/decide/track.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

TEST(TrackLooksTest, a_mended_regression_of_a_throughput_is_over) {
  MadeHistory made(50);
  for (SeriesRow& series : made.view.series) series.lower_is_better = false;
  made.slow_down("cone", 20, 1 / 1.2);
  made.slow_down("cone", 35, 1.2);
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(2));
  const auto slower = std::ranges::find(check.events, std::string(event_kind::slower), &EventRow::kind);
  ASSERT_NE(slower, check.events.end());
  EXPECT_LT(slower->effect, 0);
  EXPECT_EQ(state_of(*slower), EventState::recovered);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
}

TEST(TrackLooksTest, what_further_nights_took_back_is_cleared) {
  MadeHistory made(34);
  made.slow_down("cone", 30, 1.08);
  keep(made.view, checked(made.view));
  ASSERT_THAT(made.view.events, SizeIs(1));
  ASSERT_EQ(state_of(made.view.events.front()), EventState::suspect);
  for (const bool is_whole : {true, false}) {
    MadeHistory later(50);  // in which none of those nights is slow
    later.view.events = made.view.events;
    const HistoryView view = is_whole ? later.view : without_first_nights(later.view, 10);
    const TrackCheck check = checked(view);
    EXPECT_EQ(state_of(check.events.front()), EventState::cleared) << is_whole;
    EXPECT_EQ(check.events.front().states.back().text, "further nights took it back");
    EXPECT_EQ(exit_of(check, view, false), Exit::done);
  }
}

// A window that slides past a step sees ever fewer nights before it.
TEST(TrackLooksTest, a_look_at_fewer_nights_clears_nothing) {
  for (const double factor : {1.02, 1.06}) {
    MadeHistory made(60);
    made.slow_down("cone", 25, factor);
    keep(made.view, checked(made.view));
    ASSERT_THAT(made.view.events, SizeIs(1));
    ASSERT_EQ(state_of(made.view.events.front()), EventState::confirmed);
    for (std::size_t since = 10; since < 40; ++since) {
      const HistoryView late = without_first_nights(made.view, since);
      const TrackCheck check = checked(late);
      EXPECT_THAT(check.events, SizeIs(1)) << since << track_markdown(late, check);
      EXPECT_EQ(state_of(check.events.front()), EventState::confirmed) << since;
      EXPECT_EQ(exit_of(check, late, false), Exit::answer_is_no) << since;
      EXPECT_THAT(news_of(check), IsEmpty()) << since;
    }
  }
}

TEST(TrackLooksTest, a_regression_from_before_the_nights_looked_at_may_be_over) {
  MadeHistory made(60);
  made.slow_down("cone", 15, 1.08);
  HistoryView early = first_nights(made.view, 30);
  keep(early, checked(early));
  ASSERT_THAT(early.events, SizeIs(1));
  made.view.events = early.events;
  EXPECT_EQ(exit_of(checked(without_first_nights(made.view, 20)), made.view, false), Exit::answer_is_no);
  made.slow_down("cone", 45, 1 / 1.08);
  const TrackCheck check = checked(without_first_nights(made.view, 20));
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
  EXPECT_THAT(check.events, SizeIs(2));
}

TEST(TrackLooksTest, other_options_clear_nothing) {
  MadeHistory made(40);
  made.slow_down("cone", 25, 1.2);
  keep(made.view, checked(made.view));
  ASSERT_THAT(made.view.events, SizeIs(1));
  for (const EventOptions& options :
       {EventOptions{.change = {.least_effect = 0.5}}, EventOptions{.change = {.least_nights = 16}}}) {
    const TrackCheck check = check_history(made.view, options, kNow);
    EXPECT_THAT(news_of(check), IsEmpty());
    EXPECT_EQ(state_of(check.events.front()), EventState::confirmed);
  }
}

// A drift begins where the look does, so that the same one begins later the next night.
TEST(TrackLooksTest, a_drift_that_began_before_the_nights_looked_at_is_the_same) {
  MadeHistory made(80);
  for (std::size_t s = 0; s < made.view.series.size(); ++s)
    for (std::size_t night = 0; night < 80; ++night)
      made.view.nights[s][night].value *= std::exp(0.002 * static_cast<double>(night));
  HistoryView view = first_nights(made.view, 78);
  keep(view, checked(view));
  ASSERT_THAT(view.events, SizeIs(1));
  EXPECT_EQ(view.events.front().kind, event_kind::drift);
  HistoryView late = without_first_nights(made.view, 10);
  late.events = view.events;
  const TrackCheck check = checked(late);
  EXPECT_THAT(check.events, SizeIs(1));
  EXPECT_THAT(news_of(check), IsEmpty());
}

TEST(TrackLooksTest, a_lost_case_is_found_again_by_a_look_at_fewer_nights_only_if_it_is_ok) {
  MadeHistory made(30);
  made.change("relief", 11, crash);
  keep(made.view, checked(made.view));
  ASSERT_THAT(made.view.events, SizeIs(1));
  HistoryView late = without_first_nights(made.view, 15);
  EXPECT_EQ(state_of(checked(late).events.front()), EventState::confirmed);
  MadeHistory mended(40);
  mended.view.events = made.view.events;
  late = without_first_nights(mended.view, 32);
  EXPECT_EQ(state_of(checked(late).events.front()), EventState::recovered);
}

TEST(TrackLooksTest, a_clock_that_is_rounded_up_once_and_down_once_is_no_new_environment) {
  struct Row {
    nlohmann::json content;
    std::size_t epoch;
  };
  for (const Row& row :
       {Row{{{"num_cpus", 2}, {"mhz_per_cpu", 2500}}, 0}, Row{{{"num_cpus", 2}, {"mhz_per_cpu", 2300}}, 0},
        Row{{{"num_cpus", 2}, {"mhz_per_cpu", 2600}}, 1}, Row{{{"num_cpus", 4}, {"mhz_per_cpu", 2400}}, 1},
        Row{{{"num_cpus", 2}}, 1}}) {
    MadeHistory made(10);
    made.view.environments.front().content = {{"num_cpus", 2}, {"mhz_per_cpu", 2400}};
    made.view.environments.push_back({.id = 2, .hash = "bbbbbbbb", .content = row.content});
    for (std::size_t night = 5; night < 10; ++night) made.view.runs[night].environment = 2;
    EXPECT_EQ(Epochs(made.view).of_machine(made.view.runs.size() - 1), row.epoch) << row.content;
  }
}

// Google Benchmark's words, and those of a later version.
TEST(TrackLooksTest, a_benchmark_that_fails_is_lost) {
  struct Row {
    const char* status;
    std::size_t told_after;
  };
  for (const Row& row : {Row{"error", 1}, Row{"skipped", 2}, Row{"not_finite", 2}, Row{"of a later version", 2}})
    for (const std::size_t nights : {1U, 2U}) {
      MadeHistory made(11 + nights);
      made.change("relief", 11, [&](RepetitionRow& night) {
        night.status = row.status;
        night.is_valid = false;
        night.score = 0;
      });
      const TrackCheck check = checked(made.view);
      EXPECT_EQ(check.events.size(), nights >= row.told_after ? 1U : 0U) << row.status;
      for (const EventRow& event : check.events) EXPECT_EQ(event.kind, event_kind::lost);
    }
}

/// One benchmark of eight, of which two numbers are measured, is slower by both.
MadeHistory two_metrics() {
  MadeHistory made(40);
  for (const std::size_t s : {0U, 1U}) {
    SeriesRow& series = made.view.series[s];
    series.case_id = series.setting = "BM_a/0";
    series.scene_key = series.device = "";
    series.metric = s == 0 ? "real_time" : "cpu_time";
    for (std::size_t night = 20; night < 40; ++night) made.view.nights[s][night].value *= 1.15;
  }
  return made;
}

TEST(TrackLooksTest, of_two_metrics_of_a_benchmark_each_is_an_event_of_its_own_name) {
  const MadeHistory made = two_metrics();
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(2));
  EXPECT_NE(check.events[0].key, check.events[1].key);
  EXPECT_THAT((std::vector{check.events[0].what, check.events[1].what}),
              testing::UnorderedElementsAre("BM_a/0, real_time", "BM_a/0, cpu_time"));
}

TEST(TrackLooksTest, an_event_that_two_were_stored_as_goes_on_as_one_of_them) {
  MadeHistory made = two_metrics();
  const TrackCheck first = checked(made.view);
  made.view.events = {first.events.at(1)};  // what was written last
  made.view.events.front().id = 1;
  made.view.events.front().key = "ci-7|slower|BM_a/0|120";
  TrackCheck check = checked(made.view);
  ASSERT_THAT(news_of(check), SizeIs(1));
  EXPECT_EQ(news_of(check).front().series, first.events[0].series);
  EXPECT_EQ(news_of(check).front().key, first.events[0].key);
  const auto old = std::ranges::find(check.events, 1, &EventRow::id);
  EXPECT_EQ(old->key, "ci-7|slower|BM_a/0|120");
  EXPECT_EQ(old->series, first.events[1].series);
  keep(made.view, check);
  EXPECT_THAT(news_of(checked(made.view)), IsEmpty());
}

TEST(TrackLooksTest, cases_that_are_lost_in_two_ways_are_two_events) {
  MadeHistory made(13);
  for (std::size_t s = 0; s < 4; ++s)
    for (std::size_t night = 11; night < 13; ++night) {
      made.view.nights[s][night].status = s < 2 ? "crashed" : "compile_error";
      made.view.nights[s][night].is_valid = false;
      made.view.nights[s][night].score = 0;
    }
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(2));
  EXPECT_EQ(check.events[0].what, check.events[1].what);
  EXPECT_NE(check.events[0].key, check.events[1].key);
  for (const EventRow& event : check.events) EXPECT_EQ(event.key.size(), 64U) << "however long the names";
}

}  // namespace
}  // namespace reliefbench
