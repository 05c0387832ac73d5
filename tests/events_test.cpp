// Made-up fleets with known causes: one event for each, by its right name.
#include "tuner/decide/events.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/synthetic_history.h"

namespace reliefbench {
namespace {

/// What makes series slower from a night of the calendar on.
struct Cause {
  std::string what;  // the event's name
  std::function<bool(const SeriesTraits&)> does_move;
  std::size_t night = 0;
  double ratio = 1;
};

std::vector<CheckedSeries> moved(std::vector<CheckedSeries> fleet, const std::vector<Cause>& causes) {
  for (CheckedSeries& series : fleet)
    for (const Cause& cause : causes)
      for (std::size_t i = 0; i < series.calendar.size() && cause.does_move(series.traits); ++i)
        series.log_values[i] += series.calendar[i] >= cause.night ? std::log(cause.ratio) : 0;
  return fleet;
}

std::string events_text(const Findings& findings) {
  std::string text;
  for (const ChangeEvent& event : findings.events)
    text += fmt::format("  '{}' {} series, ({}, {}], {:+.1f} % [{:+.1f}, {:+.1f}], q {:.1g}{}{}\n", event.what,
                        event.series.size(), event.good, event.bad, 100 * event.log_ratio, 100 * event.low,
                        100 * event.high, event.q, event.is_sure ? ", sure" : "", event.is_drift ? ", drift" : "");
  return text;
}

/// One event for each cause and no others.
bool is_right(const Findings& findings, const std::vector<Cause>& causes) {
  if (findings.events.size() != causes.size()) return false;
  return std::ranges::all_of(causes, [&](const Cause& cause) {
    return std::ranges::any_of(findings.events, [&](const ChangeEvent& event) {
      return event.what == cause.what && event.good < cause.night && cause.night <= event.bad &&
             std::abs(event.log_ratio - std::log(cause.ratio)) < std::max(0.01, event.high - event.low);
    });
  });
}

using Moves = std::function<bool(const SeriesTraits&)>;

Moves of_technique(const std::string& name) {
  return [name](const SeriesTraits& traits) { return traits.technique == name; };
}
Moves of_format(const std::string& name) {
  return [name](const SeriesTraits& traits) { return traits.format == name; };
}
Moves of_backend(const std::string& name) {
  return [name](const SeriesTraits& traits) { return traits.backend == name; };
}
Moves of_machine(const std::string& name) {
  return [name](const SeriesTraits& traits) { return traits.machine == name; };
}
Moves both(const Moves& one, const Moves& other) {
  return [=](const SeriesTraits& traits) { return one(traits) && other(traits); };
}
bool everything(const SeriesTraits&) { return true; }

constexpr SyntheticFleet kUsual{};                                                       // 54 series
constexpr SyntheticFleet kBig{.backends = 2, .techniques = 7, .maps = 9, .formats = 3};  // 378 series

SyntheticFleet of_nights(SyntheticFleet fleet, std::size_t nights) {
  fleet.nights = nights;
  return fleet;
}

// How many of ten fleets are told rightly, to the last event. What is missed is mostly a series by itself too many.
TEST(Events, OneForEachCause) {
  constexpr std::uint64_t kSeeds = 10;
  struct Row {
    const char* name;
    SyntheticFleet fleet;
    std::vector<Cause> causes;
    std::uint64_t least_right = 9;
  };
  const Moves single =
      both(both(of_technique("t2"), of_format("f1")), [](const SeriesTraits& t) { return t.map == "m1"; });
  fmt::print("\nnoise 1 to 3 %: made-up fleets in which every cause is one event, and no other is told\n");
  for (const Row& row : {
           Row{"nothing", kUsual, {}},
           Row{"nothing in 12 nights", of_nights(kUsual, 12), {}},
           Row{"nothing in 120 nights", of_nights(kUsual, 120), {}},
           Row{"nothing in 378 series", kBig, {}},
           Row{"a technique", kUsual, {{"technique=t2", of_technique("t2"), 25, 1.05}}},
           Row{"a technique by 2.5 %", of_nights(kUsual, 60), {{"technique=t2", of_technique("t2"), 40, 1.025}}},
           Row{"a technique of 378 series", kBig, {{"technique=t2", of_technique("t2"), 25, 1.05}}},
           Row{"a technique on a backend",
               kBig,
               {{"b1 technique=t2", both(of_technique("t2"), of_backend("b1")), 25, 1.05}}},
           Row{"a format of a technique",
               kBig,
               {{"technique=t2 format=f1", both(of_technique("t2"), of_format("f1")), 25, 1.07}}},
           Row{"a format", kUsual, {{"format=f1", of_format("f1"), 25, 1.05}}},
           Row{"a backend", kBig, {{"b1", of_backend("b1"), 25, 1.04}}},
           Row{"a machine", kUsual, {{"everything", everything, 25, 1.04}}},
           Row{"one of two machines", {.machines = 2}, {{"everything", of_machine("machine 1"), 51, 1.04}}},
           Row{"two techniques",
               kUsual,
               {{"technique=t2", of_technique("t2"), 25, 1.05}, {"technique=t4", of_technique("t4"), 25, 1.09}}},
           Row{"two techniques, one faster",
               kUsual,
               {{"technique=t2", of_technique("t2"), 25, 1.05}, {"technique=t3", of_technique("t3"), 25, 0.93}}},
           Row{"two techniques, two nights",
               kUsual,
               {{"technique=t2", of_technique("t2"), 15, 1.05}, {"technique=t4", of_technique("t4"), 25, 1.06}}},
           Row{"a technique twice",
               kUsual,
               {{"technique=t2", of_technique("t2"), 15, 1.05}, {"technique=t2", of_technique("t2"), 28, 1.06}}},
           Row{"a case", kUsual, {{"", single, 20, 1.2}}},
           Row{"a technique, 8 + 4 nights", of_nights(kUsual, 12), {{"technique=t2", of_technique("t2"), 8, 1.1}}, 10},
           Row{"the same of 378 series", of_nights(kBig, 12), {{"technique=t2", of_technique("t2"), 8, 1.1}}, 10},
       }) {
    std::uint64_t right = 0;
    std::string wrong;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      SyntheticFleet fleet = row.fleet;
      fleet.seed = seed;
      const Findings findings = find_events(moved(synthetic_fleet(fleet), row.causes), {});
      if (is_right(findings, row.causes))
        ++right;
      else
        wrong += fmt::format("seed {}\n{}", seed, events_text(findings));
    }
    fmt::print("{:28} {:2} of {}\n", row.name, right, kSeeds);
    EXPECT_GE(right, row.least_right) << row.name << '\n' << wrong;
  }
}

/// The first nights of a fleet.
std::vector<CheckedSeries> first_nights(std::vector<CheckedSeries> fleet, std::size_t nights) {
  for (CheckedSeries& series : fleet) {
    series.calendar.resize(nights);
    series.log_values.resize(nights);
    series.standard_errors.resize(nights);
  }
  return fleet;
}

TEST(Events, FewAreFalseWithALookEveryNight) {
  constexpr std::uint64_t kSeeds = 20;
  std::uint64_t false_fleets = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const std::vector<CheckedSeries> fleet = synthetic_fleet({.seed = seed});
    bool is_false = false;
    for (std::size_t nights = 8; nights <= 40; ++nights)
      is_false |= !find_events(first_nights(fleet, nights), {}).events.empty();
    false_fleets += is_false ? 1 : 0;
  }
  fmt::print("\n54 series, 33 looks at 8 to 40 nights without a change: a false event in {} of {} fleets\n",
             false_fleets, kSeeds);
  EXPECT_LE(false_fleets, 4U);
}

TEST(Events, AreFoundSoon) {
  constexpr std::uint64_t kSeeds = 10;
  fmt::print(
      "\n54 series, noise 1 to 3 %, a look every night: fleets in which it is told by that night of the new level\n");
  fmt::print("what       change  nights before    4th   5th   8th\n");
  struct Row {
    const char* what;
    double ratio;
    std::size_t before;
    std::uint64_t least_by_fourth, least_by_eighth;
  };
  for (const Row& row :
       {Row{"technique", 1.1, 8, 10, 10}, Row{"technique", 1.05, 8, 7, 9}, Row{"technique", 1.05, 30, 10, 10},
        Row{"technique", 1.03, 30, 7, 10}, Row{"case", 1.2, 8, 6, 9}, Row{"case", 1.1, 30, 7, 9}}) {
    const bool is_case = row.what == std::string("case");
    const auto moves =
        is_case ? both(both(of_technique("t2"), of_format("f1")), [](const SeriesTraits& t) { return t.map == "m1"; })
                : of_technique("t2");
    const Cause cause{is_case ? "" : "technique=t2", moves, row.before, row.ratio};
    std::vector<std::uint64_t> told(9);
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const auto fleet = moved(synthetic_fleet({.seed = seed, .nights = row.before + 8}), {cause});
      bool is_told = false;
      for (std::size_t nights = 4; nights <= 8; ++nights) {
        const Findings findings = find_events(first_nights(fleet, row.before + nights), {});
        is_told |= std::ranges::any_of(findings.events, [&](const ChangeEvent& event) {
          return event.what == cause.what && event.good < cause.night && cause.night <= event.bad &&
                 moves(fleet[event.series[0]].traits);
        });
        told[nights] += is_told ? 1 : 0;
      }
    }
    fmt::print("{:10} {:5.0f} % {:14} {:6} {:5} {:5}  of {}\n", row.what, 100 * (row.ratio - 1), row.before, told[4],
               told[5], told[8], kSeeds);
    EXPECT_GE(told[4], row.least_by_fourth) << row.what << ' ' << row.ratio;
    EXPECT_GE(told[8], row.least_by_eighth) << row.what << ' ' << row.ratio;
  }
}

// --- by hand ---

ChangeEvent only_event(const Findings& findings) {
  EXPECT_EQ(findings.events.size(), 1U) << events_text(findings);
  return findings.events.empty() ? ChangeEvent{} : findings.events[0];
}

TEST(Events, SeriesThatStartLateMakeNoStep) {
  for (const double ratio : {1.0, 1.06}) {
    auto fleet = moved(synthetic_fleet({.seed = 3}), {{"", of_technique("t2"), 30, ratio}});
    for (std::size_t i = 0; i < fleet.size(); i += 3) {  // 15 nights in
      CheckedSeries& series = fleet[i];
      series.calendar.erase(series.calendar.begin(), series.calendar.begin() + 15);
      series.log_values.erase(series.log_values.begin(), series.log_values.begin() + 15);
      series.standard_errors.erase(series.standard_errors.begin(), series.standard_errors.begin() + 15);
    }
    const Findings findings = find_events(fleet, {});
    if (ratio > 1)
      EXPECT_EQ(only_event(findings).what, "technique=t2");
    else
      EXPECT_TRUE(findings.events.empty()) << events_text(findings);
  }
}

TEST(Events, MissingNightsAreNoMatter) {
  auto fleet = moved(synthetic_fleet({.seed = 4}), {{"", of_technique("t2"), 25, 1.06}});
  Noise noise(1);
  for (CheckedSeries& series : fleet) {
    CheckedSeries kept{.traits = series.traits, .calendar = {}, .log_values = {}, .standard_errors = {}};
    for (std::size_t i = 0; i < series.calendar.size(); ++i) {
      if (noise.uniform() < 0.25) continue;
      kept.calendar.push_back(series.calendar[i]);
      kept.log_values.push_back(series.log_values[i]);
      kept.standard_errors.push_back(series.standard_errors[i]);
    }
    series = kept;
  }
  const ChangeEvent event = only_event(find_events(fleet, {}));
  EXPECT_EQ(event.what, "technique=t2");
  EXPECT_EQ(event.series.size(), 9U);
  EXPECT_LT(event.good, 25U);
  EXPECT_GE(event.bad, 25U);
  EXPECT_TRUE(event.is_sure);
}

// A technique's cases seldom change by one ratio.
TEST(Events, MembersMayMoveByDifferentSizes) {
  auto fleet = moved(synthetic_fleet({.seed = 5}), {{"", both(of_technique("t2"), of_format("f0")), 25, 1.04},
                                                    {"", both(of_technique("t2"), of_format("f1")), 25, 1.07},
                                                    {"", both(of_technique("t2"), of_format("f2")), 25, 1.10}});
  const ChangeEvent event = only_event(find_events(fleet, {}));
  EXPECT_EQ(event.what, "technique=t2");
  EXPECT_EQ(event.series.size(), 9U);
  EXPECT_NEAR(event.log_ratio, 0.07, 0.01);
}

TEST(Events, MemberThatDidNotMoveIsLeftOut) {
  const auto moves = both(of_technique("t2"), [](const SeriesTraits& t) { return t.map != "m0" || t.format != "f0"; });
  const auto fleet = moved(synthetic_fleet({.seed = 6, .most_sigma = 0.015}), {{"", moves, 25, 1.08}});
  const ChangeEvent event = only_event(find_events(fleet, {}));
  EXPECT_EQ(event.what, "technique=t2");
  EXPECT_EQ(event.series.size(), 8U);
  EXPECT_NEAR(event.log_ratio, std::log(1.08), 0.01);
}

TEST(Events, BadNightIsNone) {
  auto fleet = moved(synthetic_fleet({.seed = 7}), {{"", everything, 20, 1.3}, {"", everything, 21, 1 / 1.3}});
  const Findings findings = find_events(fleet, {});
  EXPECT_TRUE(findings.events.empty()) << events_text(findings);
}

TEST(Events, ControlIsByItself) {
  auto fleet = synthetic_fleet({.seed = 8});
  CheckedSeries control = fleet[0];
  control.traits.is_control = true;
  for (std::size_t i = 20; i < 40; ++i) control.log_values[i] += 0.2;
  fleet.push_back(control);
  const ChangeEvent event = only_event(find_events(fleet, {}));
  EXPECT_EQ(event.what, "");
  EXPECT_EQ(event.series, std::vector<std::size_t>{fleet.size() - 1});
}

TEST(Events, DriftOfATechniqueIsOne) {
  auto fleet = synthetic_fleet({.seed = 9, .nights = 80});
  for (CheckedSeries& series : fleet)
    for (std::size_t i = 0; i < 80 && series.traits.technique == "t2"; ++i)
      series.log_values[i] += 0.001 * static_cast<double>(i);
  const ChangeEvent event = only_event(find_events(fleet, {}));
  EXPECT_EQ(event.what, "technique=t2");
  EXPECT_TRUE(event.is_drift);
  EXPECT_NEAR(event.log_ratio, 0.08, 0.02);
}

TEST(Events, WorstIsFirst) {
  const auto fleet = moved(synthetic_fleet({.seed = 10}), {{"", of_technique("t1"), 20, 0.8},
                                                           {"", of_technique("t2"), 20, 1.05},
                                                           {"", of_technique("t3"), 20, 1.1},
                                                           {"", of_technique("t4"), 35, 1.2}});
  const Findings findings = find_events(fleet, {});
  std::vector<std::string> order;
  for (const ChangeEvent& event : findings.events) order.push_back(event.what);
  EXPECT_EQ(order, (std::vector<std::string>{"technique=t3", "technique=t2", "technique=t4", "technique=t1"}));
  EXPECT_FALSE(findings.events[2].is_sure);  // 5 nights
}

// A series by itself that was slower for a while and is so again: three events, of as many series and groups as one.
TEST(Events, OfOneSeriesMayBeMany) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::vector<CheckedSeries> alone = synthetic_fleet({.seed = seed,
                                                        .techniques = 1,
                                                        .maps = 1,
                                                        .formats = 1,
                                                        .nights = 60,
                                                        .least_sigma = 0.004,
                                                        .most_sigma = 0.005});
    ASSERT_EQ(alone.size(), 1U);
    alone =
        moved(std::move(alone), {{"", everything, 13, 1.2}, {"", everything, 27, 1 / 1.2}, {"", everything, 42, 1.08}});
    const Findings findings = find_events(alone, {});
    EXPECT_EQ(findings.events.size(), 3U) << seed << '\n' << events_text(findings);
    EXPECT_TRUE(std::ranges::any_of(findings.events, [](const ChangeEvent& event) {
      return event.good < 42 && 42 <= event.bad && event.log_ratio > 0;
    })) << seed;
  }
}

TEST(Events, NothingIsNothing) {
  EXPECT_TRUE(find_events({}, {}).events.empty());
  const std::vector<CheckedSeries> empty(3);
  EXPECT_TRUE(find_events(empty, {}).events.empty());
  EXPECT_EQ(find_events(empty, {}).series.size(), 3U);
  EXPECT_TRUE(find_events(synthetic_fleet({.nights = 1}), {}).events.empty());
}

}  // namespace
}  // namespace reliefbench
