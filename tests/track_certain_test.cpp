// What a check makes of errors that changed and of cases that are lost, which need no statistics.
#include "tuner/decide/track_certain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <set>

#include "tests/looks.h"
#include "tests/made_history.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(TrackCertainTest, other_errors_are_an_alarm_of_their_own_unless_what_is_drawn_changed) {
  MadeHistory made(12);
  made.change("cone", 8, [](RepetitionRow& night) { night.score = 2; });
  TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1));
  EXPECT_EQ(check.events.front().kind, event_kind::errors);
  EXPECT_EQ(check.events.front().what, "8 cases on vulkan, technique=cone");
  EXPECT_EQ(check.events.front().good_run, MadeHistory::run_id(7));
  EXPECT_EQ(check.events.front().bad_run, MadeHistory::run_id(8));
  EXPECT_THAT(check.events.front().states.back().text, HasSubstr("e_xy.p99 0.25 -> 0.5"));
  EXPECT_EQ(exit_of(check, made.view, false), Exit::answer_is_no);
  keep(made.view, check);
  EXPECT_THAT(news_of(checked(made.view)), IsEmpty());

  made.view.events.clear();
  made.set_code("cone", 8, "other");
  check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1));
  EXPECT_EQ(state_of(check.events.front()), EventState::accepted);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
}

TEST(TrackCertainTest, a_case_that_fails_is_lost_until_it_is_ok_again) {
  MadeHistory made(12);
  made.change("relief", 11, crash);
  TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1));
  EXPECT_EQ(check.events.front().kind, event_kind::lost);
  EXPECT_EQ(state_of(check.events.front()), EventState::suspect);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::answer_is_no);

  MadeHistory later(13);
  later.change("relief", 11, crash);
  keep(later.view, check);
  EXPECT_EQ(state_of(checked(later.view).events.front()), EventState::confirmed);

  MadeHistory mended(13);
  keep(mended.view, check);
  check = checked(mended.view);
  EXPECT_EQ(state_of(check.events.front()), EventState::recovered);
  EXPECT_EQ(exit_of(check, mended.view, false), Exit::done);
}

/// Changes one night of a technique.
void change_night(MadeHistory& made, const std::string& technique, std::size_t night,
                  const std::function<void(RepetitionRow&)>& what) {
  for (std::size_t s = 0; s < made.view.series.size(); ++s)
    if (made.view.series[s].technique == technique) what(made.view.nights[s][night]);
}

/// The first nights one after the other, each looked at and kept, and looked at once more: that tells nothing.
HistoryView night_by_night(const HistoryView& whole, std::size_t first,
                           const std::function<void(std::size_t, std::vector<EventRow>&)>& then = {}) {
  HistoryView view;
  for (std::size_t count = first; count <= whole.runs.size(); ++count) {
    HistoryView tonight = first_nights(whole, count);
    tonight.events = view.events;
    keep(tonight, checked(tonight));
    if (then) then(count, tonight.events);
    for (int again = 0; again < 2; ++again) {
      const TrackCheck check = checked(tonight);
      EXPECT_THAT(news_of(check), IsEmpty()) << count << ' ' << track_markdown(tonight, check);
      keep(tonight, check);
    }
    view = tonight;
  }
  return view;
}

// It was taken for the loss that it had recovered from two nights before, for ever.
TEST(TrackCertainTest, a_case_that_fails_again_is_lost_again) {
  MadeHistory made(20);
  change_night(made, "relief", 12, crash);
  made.change("relief", 14, crash);
  const HistoryView view = night_by_night(made.view, 12);
  ASSERT_THAT(view.events, SizeIs(2));
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::answer_is_no);
  EXPECT_EQ(std::ranges::count(view.events, EventState::recovered, state_of), 1);
  EXPECT_EQ(std::ranges::count(view.events, EventState::confirmed, state_of), 1);
}

TEST(TrackCertainTest, errors_that_come_back_are_one_event_that_is_over) {
  MadeHistory made(18);
  change_night(made, "cone", 12, [](RepetitionRow& night) { night.score = 2; });
  const HistoryView view = night_by_night(made.view, 12);
  ASSERT_THAT(view.events, SizeIs(1));
  EXPECT_EQ(state_of(view.events.front()), EventState::recovered);
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::done);
  HistoryView at_once = made.view;
  keep(at_once, checked(at_once));
  EXPECT_THAT(at_once.events, SizeIs(1));
  EXPECT_EQ(exit_of(checked(at_once), at_once, false), Exit::done);
}

TEST(TrackCertainTest, errors_come_back_by_a_detour_and_only_where_all_cases_do) {
  MadeHistory made(18);
  made.view.scores.push_back({.id = 3, .values = {{"e_xy.p99", 0.75}}});
  change_night(made, "cone", 12, [](RepetitionRow& night) { night.score = 2; });
  change_night(made, "cone", 13, [](RepetitionRow& night) { night.score = 3; });
  HistoryView view = night_by_night(made.view, 12);
  ASSERT_THAT(view.events, SizeIs(2));
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::done);
  const auto stays = std::ranges::find(made.view.series, std::string("cone"), &SeriesRow::technique);
  auto& nights = made.view.nights[static_cast<std::size_t>(stays - made.view.series.begin())];
  for (std::size_t night = 14; night < 18; ++night) nights[night].score = 3;
  view = night_by_night(made.view, 12);
  ASSERT_THAT(view.events, SizeIs(2));
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::answer_is_no);
}

TEST(TrackCertainTest, errors_that_were_accepted_are_the_base_that_another_change_leads_away_from) {
  MadeHistory made(18);
  change_night(made, "cone", 12, [](RepetitionRow& night) { night.score = 2; });
  const auto accept = [](std::int64_t event, std::size_t after) {
    return [=](std::size_t count, std::vector<EventRow>& events) {
      if (count != after) return;
      const auto found = std::ranges::find(events, event, &EventRow::id);
      ASSERT_NE(found, events.end());
      found->states.push_back({.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""});
    };
  };
  HistoryView view = night_by_night(made.view, 12, accept(1, 13));
  ASSERT_THAT(view.events, SizeIs(2)) << "the way back, too";
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::answer_is_no);
  EXPECT_EQ(std::ranges::count(view.events, EventState::accepted, state_of), 1);
  view.events.back().states.push_back({.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""});
  view.events.front().states.push_back({.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""});
  EXPECT_THAT(news_of(checked(view)), IsEmpty());
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::done);
}

// Errors and crashes that come and go, with a person who accepts some of it.
TEST(TrackCertainTest, a_check_of_the_same_nights_tells_nothing_new_and_leaves_what_is_accepted) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    const auto happens = [&](unsigned one_in) { return random() % one_in == 0; };
    MadeHistory made(24, seed);
    made.view.scores.push_back({.id = 3, .values = {{"e_xy.p99", 0.75}}});
    for (auto& nights : made.view.nights) {
      std::int64_t score = 1;
      for (std::size_t night = 8; night < 24; ++night) {
        if (happens(6)) score = 1 + static_cast<std::int64_t>(random() % 3);
        nights[night].score = score;
        if (happens(8)) crash(nights[night]);
      }
    }
    std::set<std::int64_t> accepted;
    (void)night_by_night(made.view, 8, [&](std::size_t, std::vector<EventRow>& events) {
      for (EventRow& event : events) {
        if (accepted.contains(event.id)) {
          EXPECT_EQ(state_of(event), EventState::accepted) << seed << ' ' << event.what;
        } else if (is_open(event) && happens(3)) {
          event.states.push_back({.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""});
          accepted.insert(event.id);
        }
      }
    });
  }
}

TEST(TrackCertainTest, a_failure_that_may_pass_is_not_told_of_one_night) {
  for (const std::size_t nights : {12U, 13U}) {
    MadeHistory made(nights);
    made.change("relief", 11, [](RepetitionRow& night) {
      night.status = "throttled";
      night.is_valid = false;
      night.score = 0;
    });
    EXPECT_EQ(checked(made.view).events.size(), nights - 12);
  }
}

}  // namespace
}  // namespace reliefbench
