// What a check says of the series that it could not compare.
#include "tuner/decide/coverage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/looks.h"
#include "tests/made_history.h"
#include "tuner/decide/track_text.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

TEST(TrackCoverageTest, of_too_few_nights_it_says_so) {
  const auto verdict_of = [](std::size_t nights) {
    const MadeHistory made(nights);
    return verdict_text(made.view, checked(made.view));
  };
  EXPECT_THAT(verdict_of(2), HasSubstr("too few nights to tell, 6 more are needed; 24 series"));
  EXPECT_THAT(verdict_of(7), HasSubstr("too few nights to tell, 1 more is needed; 24 series"));
  EXPECT_THAT(verdict_of(8), HasSubstr("no regression"));
}

// It said "no regression" of one night of a new kernel.
TEST(TrackCoverageTest, of_too_few_nights_in_the_present_environment_it_says_so) {
  MadeHistory made(30);
  made.view.environments.push_back({.id = 2, .hash = "bbbbbbbb", .content = {}});
  made.view.runs.back().environment = 2;
  EXPECT_THAT(verdict_text(made.view, checked(made.view)),
              HasSubstr("too few nights to tell, 7 more are needed; 24 series on 1 machine, 30 nights; 24 series have "
                        "too few nights in the present environment"));
}

TEST(TrackCoverageTest, of_series_that_are_measured_no_more_it_says_so) {
  for (const std::size_t nights : {3U, 4U, 8U}) {
    MadeHistory made(20 + nights);
    for (std::size_t s = 0; s < made.view.series.size(); ++s)
      if (made.view.series[s].technique == "cone") made.view.nights[s].resize(20);
    const std::string verdict = verdict_text(made.view, checked(made.view));
    if (nights < 4)
      EXPECT_THAT(verdict, HasSubstr("no regression; 24 series on 1 machine"));
    else
      EXPECT_THAT(verdict, HasSubstr("no regression; 16 series on 1 machine, " + std::to_string(20 + nights) +
                                     " nights; 8 more have no value since 2025-10-28"));
  }
}

// Each of five binaries of benchmarks is a run a night.
TEST(TrackCoverageTest, a_series_that_is_in_every_fifth_run_is_not_gone) {
  MadeHistory made(64);
  for (std::size_t s = 0; s < made.view.series.size(); ++s)
    std::erase_if(made.view.nights[s], [&](const RepetitionRow& night) {
      return static_cast<std::size_t>(night.run - MadeHistory::run_id(0)) % 5 != s % 5;
    });
  EXPECT_THAT(verdict_text(made.view, checked(made.view)), HasSubstr("no regression; 24 series on 1 machine"));
}

}  // namespace
}  // namespace reliefbench
