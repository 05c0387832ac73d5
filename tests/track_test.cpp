// What a check makes of a history: which events there are, what state each has, and how that goes on from night to
// night.
#include "tuner/decide/track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "tests/looks.h"
#include "tests/made_history.h"
#include "tuner/decide/epochs.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(TrackTest, says_nothing_where_nothing_moved) {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    const MadeHistory made(40, seed);
    const TrackCheck check = checked(made.view);
    EXPECT_THAT(check.events, IsEmpty()) << seed;
    EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
    EXPECT_EQ(check.coverage.looked_at, 24U);
    EXPECT_THAT(verdict_text(made.view, check),
                HasSubstr("no regression; 24 series on 1 machine, 40 nights; a step of"));
  }
}

/// So many series without anything in common, on one machine.
HistoryView unlike_series(std::size_t count, std::size_t nights, double sigma, unsigned seed) {
  HistoryView view = MadeHistory(nights).view;
  for (RunRow& run : view.runs) run.calibrations.clear();
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma);
  view.series.resize(count, view.series.front());
  view.nights.resize(count, view.nights.front());
  for (std::size_t s = 0; s < count; ++s) {
    view.series[s].id = static_cast<std::int64_t>(s + 1);
    for (std::string* name : {&view.series[s].technique, &view.series[s].case_id, &view.series[s].setting})
      *name = "t" + std::to_string(s);
    for (RepetitionRow& night : view.nights[s]) night.value = std::exp(noise(random));
    for (RepetitionRow& night : view.nights[s]) night.standard_error = sigma / 2;
  }
  return view;
}

// "a step of 1 % in a case would be found within five nights": of 40 none was, since --least-effect is 1.5 %.
TEST(TrackTest, a_step_of_the_size_that_it_names_is_told_within_five_nights) {
  constexpr std::size_t kSeries = 40;
  constexpr unsigned kSeeds = 10;
  constexpr std::size_t kNights = 60;
  for (const std::size_t one_in : {2U, 20U})
    for (const double sigma : {0.003, 0.006, 0.012}) {
      std::size_t steps = 0;
      std::size_t told = 0;
      double named = 0;
      for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        HistoryView view = unlike_series(kSeries, kNights + 5, sigma, seed);
        const double size = checked(first_nights(view, kNights)).case_shift;
        named += size / kSeeds;
        for (std::size_t s = 0; s < kSeries; s += one_in, ++steps)
          for (std::size_t night = kNights; night < kNights + 5; ++night)
            view.nights[s][night].value *= steps % 2 == 0 ? 1 + size : 1 / (1 + size);
        const TrackCheck check = checked(view);
        std::set<std::int64_t> moved;
        for (const EventRow& event : check.events) moved.insert(event.series.begin(), event.series.end());
        for (std::size_t s = 0; s < kSeries; s += one_in) told += moved.count(view.series[s].id);
      }
      const double share = static_cast<double>(told) / static_cast<double>(steps);
      std::printf("noise %.1f %%, one series in %zu: of steps of %.1f %% %.0f %% are told\n", 100 * sigma, one_in,
                  100 * named, 100 * share);
      EXPECT_GE(share, 0.85) << sigma << ' ' << one_in;
    }
}

TEST(TrackTest, no_night_is_no_answer) {
  EXPECT_EQ(exit_of(checked({}), {}, false), Exit::nothing_measured);
  const MadeHistory one(1);
  EXPECT_EQ(exit_of(checked(one.view), one.view, false), Exit::done);
}

TEST(TrackTest, a_slower_technique_is_one_event_that_names_it_and_where_it_began) {
  MadeHistory made(40);
  made.slow_down("relaxed_cone", 25, 1.05);
  made.set_code("relaxed_cone", 25, "other");
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1));
  const EventRow& event = check.events.front();
  EXPECT_EQ(event.kind, event_kind::slower);
  EXPECT_THAT(event.what, HasSubstr("technique=relaxed_cone"));
  EXPECT_THAT(event.series, SizeIs(MadeHistory::kCases));
  EXPECT_LE(event.low, 0.05);
  EXPECT_GE(event.high, 0.05);
  EXPECT_LE(event.good_run, MadeHistory::run_id(24));
  EXPECT_GE(event.bad_run, MadeHistory::run_id(25));
  EXPECT_LE(event.bad_run - event.good_run, 4);
  EXPECT_EQ(state_of(event), EventState::confirmed);
  EXPECT_THAT(event.states.back().text, HasSubstr("what is drawn changed as well"));
  EXPECT_TRUE(check.is_news.front());
  EXPECT_EQ(exit_of(check, made.view, false), Exit::answer_is_no);
}

// On a software rasteriser a night shifts all cases by some percent: what a technique does beside them shows all the
// same.
TEST(TrackTest, a_technique_shows_beside_what_its_nights_share) {
  constexpr unsigned kSeeds = 20;
  unsigned found = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    MadeHistory made(12, seed);
    made.shake(0.04, seed);
    EXPECT_THAT(checked(made.view).events, IsEmpty()) << seed;
    made.slow_down("relaxed_cone", 8, 1.1);
    const TrackCheck check = checked(made.view);
    EXPECT_LE(check.events.size(), 1U) << seed << track_markdown(made.view, check);
    found += !check.events.empty() && check.events.front().kind == event_kind::slower &&
             check.events.front().series.size() == MadeHistory::kCases;
  }
  EXPECT_GE(found, kSeeds - 1);
}

TEST(TrackTest, it_is_suspect_first_then_confirmed_and_told_once_a_state) {
  MadeHistory made(40);
  made.slow_down("cone", 25, 1.06);
  std::vector<EventState> states;
  HistoryView view;
  for (std::size_t count = 20; count <= 40; ++count) {
    HistoryView tonight = first_nights(made.view, count);
    tonight.events = view.events;
    const TrackCheck check = checked(tonight);
    keep(tonight, check);
    ASSERT_LE(check.events.size(), 1U) << count;
    if (!check.events.empty() && check.is_news.front()) states.push_back(state_of(check.events.front()));
    if (!check.events.empty()) {
      EXPECT_EQ(exit_of(check, tonight, true) == Exit::answer_is_no, check.is_news.front()) << count;
    }
    view = tonight;
  }
  EXPECT_THAT(states, testing::ElementsAre(EventState::suspect, EventState::confirmed));
  EXPECT_THAT(view.events, SizeIs(1));
}

TEST(TrackTest, where_the_control_case_moved_along_and_nothing_that_is_drawn_did_it_is_the_environment) {
  MadeHistory made(40);
  made.slow_down("relief", 25, 1.06);
  made.slow_control(25, 1.08);
  const TrackCheck check = checked(made.view);
  ASSERT_FALSE(check.events.empty());
  for (const EventRow& event : check.events) EXPECT_EQ(state_of(event), EventState::environment) << event.what;
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);

  made.set_code("relief", 25, "other");  // then it may be the shaders after all
  EXPECT_EQ(exit_of(checked(made.view), made.view, false), Exit::answer_is_no);
}

/// Gives the techniques but for one another device, that of another backend.
void add_device(MadeHistory& made, const std::string& technique) {
  for (SeriesRow& series : made.view.series) {
    if (series.technique == technique) continue;
    series.backend = "opengl";
    series.device = "opengl fake";
  }
  for (RunRow& run : made.view.runs) {
    run.calibrations.push_back(run.calibrations.front());
    run.calibrations.back().device = "opengl fake";
  }
}

// It hid a regression on one backend that the other's driver became slower in the same night.
TEST(TrackTest, the_control_case_of_another_device_explains_nothing) {
  MadeHistory made(40);
  add_device(made, "cone");
  made.slow_down("cone", 25, 1.2);
  for (std::size_t night = 25; night < 40; ++night) made.view.runs[night].calibrations.back().control_ns *= 1.25;
  EXPECT_EQ(exit_of(checked(made.view), made.view, false), Exit::answer_is_no);
  made.slow_control(25, 1.25);
  EXPECT_EQ(exit_of(checked(made.view), made.view, false), Exit::done);
}

// It said "no regression" of two nights, in green.
TEST(TrackTest, an_improvement_is_told_and_is_no_regression) {
  MadeHistory made(40);
  made.slow_down("cone", 25, 0.9);
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1));
  EXPECT_EQ(check.events.front().kind, event_kind::faster);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
  EXPECT_THAT(verdict_text(made.view, check), HasSubstr("no regression, 1 improvement"));
}

TEST(TrackTest, what_was_accepted_is_the_new_base) {
  MadeHistory made(40);
  made.slow_down("cone", 20, 1.08);
  TrackCheck check = checked(made.view);
  keep(made.view, check);
  made.view.events.front().states.push_back({.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""});
  check = checked(made.view);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
  EXPECT_EQ(state_of(check.events.front()), EventState::accepted);
  EXPECT_THAT(news_of(check), IsEmpty());
  made.slow_down("cone", 30, 1.08);  // and once more
  check = checked(made.view);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::answer_is_no);
  EXPECT_THAT(news_of(check), SizeIs(1));
}

// It was accepted at 4.7 %, and was so still at 14.9 %.
TEST(TrackTest, a_drift_that_goes_on_is_open_again) {
  MadeHistory made(100);
  for (std::size_t s = 0; s < made.view.series.size(); ++s)
    for (std::size_t night = 0; night < 100; ++night)
      made.view.nights[s][night].value *= std::exp(0.002 * static_cast<double>(night));
  HistoryView view = first_nights(made.view, 60);
  keep(view, checked(view));
  ASSERT_THAT(view.events, SizeIs(1));
  ASSERT_EQ(view.events.front().kind, event_kind::drift);
  double accepted = view.events.front().effect;
  const EventStateRow yes{.unix_s = kNow, .state = EventState::accepted, .by = "ann", .text = ""};
  view.events.front().states.push_back(yes);
  std::size_t reopened = 0;
  for (std::size_t count = 60; count <= 100; ++count) {
    HistoryView tonight = first_nights(made.view, count);
    tonight.events = view.events;
    const TrackCheck check = checked(tonight);
    ASSERT_THAT(check.events, SizeIs(1)) << count;
    const EventRow& drift = check.events.front();
    EXPECT_EQ(exit_of(check, tonight, true) == Exit::answer_is_no, state_of(drift) != EventState::accepted);
    if (state_of(drift) == EventState::accepted) {
      EXPECT_EQ(drift.effect, accepted);
      continue;
    }
    EXPECT_THAT(drift.states.back().text, HasSubstr("it went on since it was accepted at 1"));
    EXPECT_GT(drift.low, accepted + 0.015);
    accepted = drift.effect;
    ++reopened;
    keep(view, check);
    EXPECT_THAT(news_of(checked(tonight)), SizeIs(1)) << "of the events before that were kept";
    tonight.events = view.events;
    EXPECT_THAT(news_of(checked(tonight)), IsEmpty());
    view.events.front().states.push_back(yes);
  }
  EXPECT_GE(reopened, 2U);
  EXPECT_LE(reopened, 5U) << "8 % more in all";
}

TEST(TrackTest, a_regression_that_was_mended_is_over) {
  MadeHistory made(50);
  made.slow_down("cone", 20, 1.08);
  HistoryView early = first_nights(made.view, 30);
  keep(early, checked(early));
  EXPECT_EQ(state_of(early.events.front()), EventState::confirmed);
  made.slow_down("cone", 35, 1 / 1.08);
  made.view.events = early.events;
  const TrackCheck check = checked(made.view);
  EXPECT_EQ(exit_of(check, made.view, false), Exit::done);
  EXPECT_TRUE(std::ranges::any_of(check.events, [](const EventRow& event) {
    return event.kind == event_kind::slower && state_of(event) == EventState::recovered;
  }));
}

TEST(TrackTest, a_new_environment_opens_an_epoch_and_is_no_event) {
  MadeHistory made(40);
  made.view.environments.push_back({.id = 2, .hash = "bbbbbbbb", .content = {}});
  for (std::size_t night = 20; night < 40; ++night) made.view.runs[night].environment = 2;
  made.slow_down("", 20, 1.3);  // another driver
  EXPECT_THAT(checked(made.view).events, IsEmpty());
  EXPECT_EQ(Epochs(made.view).of_machine(made.view.runs.size() - 1), 1U);
  made.slow_down("cone", 30, 1.08);  // within the epoch
  EXPECT_EQ(exit_of(checked(made.view), made.view, false), Exit::answer_is_no);
}

/// A history on two backends, of which the second is measured in all nights but `missing`.
HistoryView two_backends(MadeHistory& made, std::size_t missing) {
  add_device(made, "cone");
  const auto device = [](const char* backend, const char* driver) {
    return nlohmann::json{{"backend", backend}, {"name", "fake"}, {"driver", driver}};
  };
  HistoryView view = made.view;
  view.environments = {
      {.id = 1, .hash = "a", .content = {{"devices", {device("vulkan", "1"), device("opengl", "1")}}}},
      {.id = 2, .hash = "b", .content = {{"devices", {device("vulkan", "1")}}}},
      {.id = 3, .hash = "c", .content = {{"devices", {device("vulkan", "1"), device("opengl", "2")}}}}};
  view.runs[missing].environment = 2;
  view.runs[missing].calibrations.pop_back();
  for (std::size_t s = 0; s < view.series.size(); ++s)
    if (view.series[s].backend == "opengl")
      view.nights[s].erase(view.nights[s].begin() + static_cast<std::ptrdiff_t>(missing));
  return view;
}

TEST(TrackTest, what_becomes_of_another_backend_hides_no_step) {
  MadeHistory made(40);
  made.slow_down("cone", 25, 1.2);
  HistoryView view = two_backends(made, 25);
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::answer_is_no) << "a night without it";
  EXPECT_EQ(Epochs(view).of_machine(39), 0U);
  for (std::size_t night = 26; night < 40; ++night) view.runs[night].environment = 3;
  EXPECT_EQ(exit_of(checked(view), view, false), Exit::answer_is_no) << "a driver of its own";
  EXPECT_EQ(Epochs(view).of(39, "vulkan fake"), 0U);
  EXPECT_EQ(Epochs(view).of(39, "opengl fake"), 26U);
}

// Two kernels in turns, or two machines of one name.
TEST(TrackTest, an_environment_that_comes_back_goes_on_with_its_epoch) {
  MadeHistory made(40);
  made.view.environments.push_back({.id = 2, .hash = "bbbbbbbb", .content = {}});
  made.slow_down("cone", 20, 1.2);
  for (std::size_t night = 1; night < 40; night += 2) {
    made.view.runs[night].environment = 2;
    for (auto& nights : made.view.nights) nights[night].value *= 1.4;
  }
  const TrackCheck check = checked(made.view);
  ASSERT_THAT(check.events, SizeIs(1)) << track_markdown(made.view, check);
  EXPECT_THAT(check.events.front().what, HasSubstr("technique=cone"));
  EXPECT_EQ(exit_of(check, made.view, false), Exit::answer_is_no);
  keep(made.view, check);
  EXPECT_THAT(news_of(checked(made.view)), IsEmpty());
}

TEST(TrackTest, what_a_rerun_cleared_and_stays_is_the_environment) {
  MadeHistory made(40);
  made.slow_down("cone", 34, 1.06);
  HistoryView early = first_nights(made.view, 38);
  keep(early, checked(early));
  ASSERT_THAT(early.events, SizeIs(1));
  ASSERT_EQ(state_of(early.events.front()), EventState::suspect);
  early.events.front().states.push_back({.unix_s = kNow, .state = EventState::cleared, .by = "confirm", .text = ""});
  EXPECT_EQ(exit_of(checked(early), early, false), Exit::done);
  MadeHistory later(60);
  later.slow_down("cone", 34, 1.06);
  later.view.events = early.events;
  const TrackCheck check = checked(later.view);
  EXPECT_EQ(state_of(check.events.front()), EventState::environment);
}

TEST(TrackTest, speaks_to_machines_and_people) {
  MadeHistory made(40);
  made.slow_down("relaxed_cone", 25, 1.05);
  made.view.runs.back().machine = "ci-7";
  TrackCheck check = checked(made.view);
  check.events.front().what += " <b>&\"*";
  const nlohmann::json json = track_json(made.view, check);
  EXPECT_EQ(json.at("events").size(), 1U);
  EXPECT_EQ(json.at("events")[0].at("cases").size(), MadeHistory::kCases);
  EXPECT_THAT(track_markdown(made.view, check), HasSubstr("**confirmed**, new:"));
  EXPECT_THAT(track_markdown(made.view, check), HasSubstr("\\<b\\>&\"\\*"));
  EXPECT_THAT(track_junit(made.view, check), HasSubstr("failures=\"1\""));
  EXPECT_THAT(track_junit(made.view, check), HasSubstr("&lt;b&gt;&amp;&quot;*"));
  EventRow event = check.events.front();
  event.effect = -0.052;
  event.low = -0.06;
  event.high = -0.041;
  event.kind = event_kind::faster;
  EXPECT_EQ(effect_text(event), "5.2 % faster [4.1, 6]");
}

}  // namespace
}  // namespace reliefbench
