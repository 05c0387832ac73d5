#include "tuner/decide/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/hand_made.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using StoredRun = reliefbench::Run;  // in a test body, Run is testing::Test::Run

constexpr int kFewCases = 40;

struct Synthetic {
  unsigned seed = 1;
  int samples = 12;
  int slow_cases = 0;  ///< the first so many cases take longer
  double slowdown = 1.2;
  double device_speed = 1;  ///< what everything, the control case too, takes
  bool with_control = true;
  double noise = 0.01;
};

std::string relief_case(int i) { return "relief@rocks/top?linear_steps=" + std::to_string(i); }

/// Rounds over all cases with control samples between, on a machine whose speed drifts by a quarter either way: far
/// more than the threshold.
StoredRun synthetic_run(const Synthetic& made) {
  std::mt19937 random(made.seed);
  std::normal_distribution<double> noise(0, made.noise);
  const double phase = std::uniform_real_distribution<double>(0, 6.28)(random);
  StoredRun run;
  run.folder = "run" + std::to_string(made.seed);
  run.info = {
      {"identity", {{"devices", {{{"backend", "null"}, {"name", "fake"}, {"driver", "1.0"}}}}}},
      {"host", {{"cpu", "some"}, {"os", "some"}}},
  };
  double at_ns = 0;
  const auto sample = [&](const std::string& id, int round, double frame_time_ns) {
    at_ns += 5e6;
    const double drift = 1 + 0.25 * std::sin(phase + at_ns / 5e8);
    run.samples.push_back({.case_id = id,
                           .round = round,
                           .frames = 1,
                           .frame_time_ns = frame_time_ns * made.device_speed * drift * std::exp(noise(random)),
                           .at_ns = at_ns});
  };
  for (int round = 0; round < made.samples; ++round) {
    for (int i = 0; i < kFewCases; ++i) {
      if (i % 4 == 0 && made.with_control) sample("control@null", round, 500);
      sample(relief_case(i), round, (1000 + 100 * i) * (i < made.slow_cases ? made.slowdown : 1));
    }
  }
  for (int i = 0; i < kFewCases; ++i) run.records.push_back(make_record({.case_id = relief_case(i)}));
  return run;
}

int count(const Comparison& comparison, Change change) {
  int result = 0;
  for (const CaseChange& c : comparison.cases) result += c.change == change ? 1 : 0;
  return result;
}

class CompareSeeds : public ::testing::TestWithParam<unsigned> {};

TEST_P(CompareSeeds, finds_nothing_between_equal_runs_however_the_machine_drifts) {
  const Comparison comparison =
      compare_runs(synthetic_run({.seed = GetParam()}), synthetic_run({.seed = GetParam() + 1000}), {});
  EXPECT_EQ(comparison.matched, static_cast<std::size_t>(kFewCases));
  EXPECT_EQ(count(comparison, Change::slower), 0);
  EXPECT_EQ(count(comparison, Change::faster), 0);
  EXPECT_GT(count(comparison, Change::same), kFewCases / 2);
  EXPECT_NEAR(comparison.groups.at(0).ratio.ratio, 1, 0.02);
  EXPECT_EQ(comparison.groups.at(0).change, Change::same);
  EXPECT_EQ(exit_of(comparison), Exit::done);
}

TEST_P(CompareSeeds, finds_the_slowed_cases_and_no_other) {
  const StoredRun base = synthetic_run({.seed = GetParam()});
  const StoredRun now = synthetic_run({.seed = GetParam() + 1000, .slow_cases = 5});
  const Comparison comparison = compare_runs(base, now, {});
  EXPECT_EQ(count(comparison, Change::slower), 5);
  EXPECT_EQ(count(comparison, Change::faster), 0);
  for (std::size_t i = 0; i < comparison.cases.size(); ++i) {
    const CaseChange& c = comparison.cases[i];
    EXPECT_EQ(c.change == Change::slower, i < 5) << "worst first: " << c.case_id;
    if (i < 5) {
      EXPECT_NEAR(c.ratio.ratio, 1.2, 0.05);
      EXPECT_LE(c.p, 0.05);
    }
  }
  EXPECT_EQ(exit_of(comparison), Exit::answer_is_no);

  const Comparison reverse = compare_runs(now, base, {});
  EXPECT_EQ(count(reverse, Change::faster), 5);
  EXPECT_EQ(count(reverse, Change::slower), 0);
  EXPECT_EQ(exit_of(reverse), Exit::done);
}

INSTANTIATE_TEST_SUITE_P(Many, CompareSeeds, ::testing::Range(1U, 9U));

TEST(Compare, shows_a_change_of_the_whole_device_in_the_control_case_only) {
  const StoredRun base = synthetic_run({.seed = 1});
  const StoredRun now = synthetic_run({.seed = 1, .device_speed = 2});
  const Comparison relative = compare_runs(base, now, {});
  EXPECT_EQ(count(relative, Change::slower), 0);
  ASSERT_THAT(relative.control_ratio, SizeIs(1));
  EXPECT_THAT(relative.warnings, ElementsAre(HasSubstr("control case on null takes 2.000 times as long")));
  EXPECT_EQ(relative.control_ratio[0].first, "null");
  EXPECT_NEAR(relative.control_ratio[0].second, 2, 1e-9);

  const Comparison raw = compare_runs(base, now, {.metric = "frame_time_raw"});
  EXPECT_NEAR(raw.groups.at(0).ratio.ratio, 2, 1e-9);
  EXPECT_EQ(count(raw, Change::slower), kFewCases);
}

TEST(Compare, warns_where_there_is_no_control_case) {
  const StoredRun base = synthetic_run({.seed = 1, .with_control = false});
  const Comparison comparison = compare_runs(base, base, {});
  EXPECT_THAT(comparison.control_ratio, IsEmpty());
  EXPECT_THAT(comparison.warnings, ElementsAre(HasSubstr("no control samples of null")));
  EXPECT_EQ(comparison.groups.at(0).ratio.ratio, 1);
}

// What can be told depends on the intervals, not on the count of samples: 40 cases of five samples once could not reach
// any corrected p.
TEST(Compare, finds_slow_cases_with_few_but_steady_samples) {
  const Comparison comparison = compare_runs(synthetic_run({.seed = 1, .samples = 5}),
                                             synthetic_run({.seed = 2, .samples = 5, .slow_cases = 5}), {});
  EXPECT_EQ(count(comparison, Change::slower), 5);
  EXPECT_EQ(exit_of(comparison), Exit::answer_is_no);
}

TEST(Compare, is_inconclusive_where_noise_hides_what_matters) {
  const Comparison comparison = compare_runs(synthetic_run({.seed = 1, .samples = 3, .noise = 0.15}),
                                             synthetic_run({.seed = 2, .samples = 3, .noise = 0.15}), {});
  EXPECT_EQ(count(comparison, Change::slower), 0);
  EXPECT_GT(count(comparison, Change::unclear), kFewCases / 2);
  EXPECT_TRUE(is_inconclusive(comparison));
  EXPECT_EQ(exit_of(comparison), Exit::inconclusive);
}

TEST(Compare, knows_nothing_from_one_sample_a_case) {
  const Comparison comparison =
      compare_runs(synthetic_run({.seed = 1, .samples = 1}), synthetic_run({.seed = 2, .samples = 1}), {});
  EXPECT_EQ(count(comparison, Change::unclear), kFewCases);
  EXPECT_EQ(exit_of(comparison), Exit::inconclusive);
  EXPECT_TRUE(comparison_json(comparison).at("cases").at(0).at("ci").at(1).is_null());
}

TEST(Compare, a_verdict_has_its_reason) {
  const auto reasons_of = [](const Synthetic& base, const Synthetic& now, const CompareOptions& options = {}) {
    std::map<Reason, int> reasons;
    for (const CaseChange& one : compare_runs(synthetic_run(base), synthetic_run(now), options).cases)
      ++reasons[one.reason];
    return reasons;
  };
  EXPECT_EQ(reasons_of({.seed = 1}, {.seed = 2, .slow_cases = 5})[Reason::beyond_chance], 5);
  EXPECT_EQ(reasons_of({.seed = 1}, {.seed = 1})[Reason::same_measurement], kFewCases);
  EXPECT_GT(reasons_of({.seed = 1}, {.seed = 2})[Reason::interval_within_threshold], kFewCases / 2);
  EXPECT_GT(reasons_of({.seed = 1, .samples = 3, .noise = 0.15},
                       {.seed = 2, .samples = 3, .noise = 0.15})[Reason::too_few_samples],
            kFewCases / 2);
  EXPECT_GT(reasons_of({.seed = 1, .noise = 0.045}, {.seed = 2, .noise = 0.045})[Reason::interval_spans_threshold], 3);
  EXPECT_EQ(reasons_of({.seed = 1}, {.seed = 2, .slow_cases = 5, .device_speed = 2})[Reason::control_drift], 5);
  // No more than the control case's own move: that may be what these cases felt of it. Beyond it: a change.
  const StoredRun base = synthetic_run({.seed = 1});
  const StoredRun other_state = synthetic_run({.seed = 2, .slow_cases = 5, .device_speed = 2});
  EXPECT_EQ(count(compare_runs(base, other_state, {}), Change::slower), 0);
  const StoredRun far_slower = synthetic_run({.seed = 2, .slow_cases = 5, .slowdown = 1.5, .device_speed = 1.2});
  EXPECT_EQ(count(compare_runs(base, far_slower, {}), Change::slower), 5);
}

TEST(Compare, a_run_and_itself_are_the_same_however_noisy) {
  const StoredRun run = synthetic_run({.seed = 1, .samples = 3, .noise = 0.5});
  const Comparison comparison = compare_runs(run, run, {});
  EXPECT_EQ(count(comparison, Change::same), kFewCases);
  for (const GroupChange& group : comparison.groups) EXPECT_EQ(group.change, Change::same) << group.group;
  EXPECT_EQ(exit_of(comparison), Exit::done);
}

TEST(Compare, more_taps_are_no_worse_error) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  (*now.records[3].error)["taps.mean"] = base.records[3].error->at("taps.mean") + 5;
  for (const std::string metric : {"frame_time", "taps.mean"}) {
    const Comparison comparison = compare_runs(base, now, {.metric = metric});
    ASSERT_THAT(comparison.errors, SizeIs(1));
    EXPECT_FALSE(comparison.errors[0].worse);
    EXPECT_EQ(error_change_id(comparison.errors[0]), "more");
    EXPECT_EQ(error_change_id(compare_runs(now, base, {}).errors.at(0)), "fewer");
    EXPECT_EQ(exit_of(comparison), Exit::done);
  }
}

TEST(Compare, lists_errors_that_changed_and_judges_their_direction) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  (*now.records[3].error)["e_xy.p99"] = 0.25;
  const Comparison worse = compare_runs(base, now, {});
  ASSERT_THAT(worse.errors, SizeIs(1));
  EXPECT_EQ(worse.errors[0].case_id, relief_case(3));
  EXPECT_EQ(worse.errors[0].metric, "e_xy.p99");
  EXPECT_EQ(worse.errors[0].base, 0.0);
  EXPECT_EQ(worse.errors[0].now, 0.25);
  EXPECT_TRUE(worse.errors[0].worse);
  EXPECT_EQ(exit_of(worse), Exit::answer_is_no);

  const Comparison better = compare_runs(now, base, {});
  EXPECT_FALSE(better.errors.at(0).worse);
  EXPECT_EQ(exit_of(better), Exit::done);
}

TEST(Compare, takes_identical_pictures_for_the_best_psnr) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  (*now.records[0].error)["psnr"] = 60;
  EXPECT_TRUE(compare_runs(base, now, {}).errors.at(0).worse);
  EXPECT_FALSE(compare_runs(now, base, {}).errors.at(0).worse);
}

TEST(Compare, looks_at_one_error_metric_when_asked) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  (*now.records[0].error)["e_xy.p99"] = 1;
  (*now.records[1].error)["missed_rate"] = 0.5;
  const Comparison comparison = compare_runs(base, now, {.metric = "missed_rate"});
  EXPECT_THAT(comparison.cases, IsEmpty());
  ASSERT_THAT(comparison.errors, SizeIs(1));
  EXPECT_EQ(comparison.errors[0].case_id, relief_case(1));
  EXPECT_EQ(exit_of(comparison), Exit::answer_is_no);
  EXPECT_THROW((void)compare_runs(base, now, {.metric = "no_such"}), Error);
}

TEST(Compare, lists_cases_of_one_run_only_and_cases_that_were_lost) {
  StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  base.records[0].case_id = "old";
  now.records[0].case_id = "new";
  now.records[1].status = Status::compile_error;
  now.records[1].reason = "why";
  const Comparison comparison = compare_runs(base, now, {});
  EXPECT_THAT(comparison.only_base, ElementsAre("old"));
  EXPECT_THAT(comparison.only_new, ElementsAre("new"));
  EXPECT_THAT(comparison.lost, ElementsAre(relief_case(1) + ": compile_error why"));
  EXPECT_EQ(comparison.matched, static_cast<std::size_t>(kFewCases - 2));
  EXPECT_EQ(exit_of(comparison), Exit::answer_is_no);
}

TEST(Compare, a_scene_under_another_name_is_compared_by_its_key) {
  StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = synthetic_run({.seed = 2, .slow_cases = 5});
  const auto rename = [](std::string& id) { id.replace(id.find("rocks/top"), 9, "stones/top"); };
  for (Record& record : base.records) record.scene_key = SceneKey{std::string(64, 'a')};
  for (Record& record : now.records) {
    record.scene_key = SceneKey{std::string(64, 'a')};
    record.scene = "stones/top";
    rename(record.case_id);
  }
  for (Sample& sample : now.samples)
    if (std::string id = sample.case_id; id.find("rocks") != std::string::npos) {
      rename(id);
      sample.case_id = id;
    }
  const Comparison comparison = compare_runs(base, now, {});
  EXPECT_EQ(comparison.matched, static_cast<std::size_t>(kFewCases));
  EXPECT_EQ(count(comparison, Change::slower), 5);
}

TEST(Compare, an_unfinished_run_settles_nothing) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun half = base;
  half.records.resize(half.records.size() / 2);
  EXPECT_EQ(exit_of(compare_runs(base, half, {})), Exit::done) << "a part that was asked for";
  half.info["finished"] = nullptr;
  const Comparison comparison = compare_runs(base, half, {});
  EXPECT_EQ(exit_of(comparison), Exit::inconclusive);
  EXPECT_THAT(comparison.warnings, ElementsAre(HasSubstr("is not finished")));
}

TEST(Compare, measures_nothing_where_nothing_matches) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  for (Record& record : now.records) record.case_id += "&more";
  const Comparison comparison = compare_runs(base, now, {});
  EXPECT_EQ(comparison.matched, 0U);
  EXPECT_THAT(comparison.only_base, SizeIs(kFewCases));
  EXPECT_EQ(exit_of(comparison), Exit::nothing_measured);
}

TEST(Compare, refuses_other_devices_and_drivers_but_only_warns_of_another_host) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun other_driver = base;
  other_driver.info["identity"]["devices"][0]["driver"] = "2.0";
  try {
    (void)compare_runs(base, other_driver, {});
    FAIL() << "another driver was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("fake, 1.0"));
    EXPECT_THAT(error.what(), HasSubstr("fake, 2.0"));
  }
  const Comparison across = compare_runs(base, other_driver, {.across_drivers = true});
  EXPECT_THAT(across.drivers, ElementsAre("null: 1.0, now 2.0"));
  StoredRun other_host = base;
  other_host.info["host"]["cpu"] = "other";
  EXPECT_THAT(compare_runs(base, other_host, {}).warnings, ElementsAre("the host's cpu differs: some, now other"));
  StoredRun broken = base;
  broken.info = nlohmann::json::object();
  EXPECT_THROW((void)compare_runs(base, broken, {}), Error);
}

TEST(Compare, refuses_a_measured_case_without_samples) {
  const StoredRun base = synthetic_run({.seed = 1});
  StoredRun now = base;
  std::erase_if(now.samples, [](const Sample& sample) { return sample.case_id == relief_case(7); });
  EXPECT_THROW((void)compare_runs(base, now, {}), Error);
}

TEST(Compare, is_written_whole) {
  const StoredRun base = synthetic_run({.seed = 1});
  const nlohmann::json json = comparison_json(compare_runs(base, synthetic_run({.seed = 2, .slow_cases = 1}), {}));
  EXPECT_EQ(json.at("matched"), kFewCases);
  EXPECT_EQ(json.at("cases").at(0).at("change"), "slower");
  EXPECT_EQ(json.at("cases").at(0).at("ci").size(), 2U);
  EXPECT_TRUE(json.at("control_ratio").contains("null"));
  EXPECT_TRUE(json.at("between_runs").contains("null"));
  EXPECT_EQ(json.at("groups").at(0).at("group"), "all");
  EXPECT_EQ(json.at("groups").at(0).at("cases"), kFewCases);
  EXPECT_EQ(json.at("assumed").size(), 2U);
  EXPECT_EQ(json.at("inconclusive"), false);
}

Sample sample_at(double at_ns, double frame_time_ns) {
  return {.case_id = "a", .round = 0, .frames = 1, .frame_time_ns = frame_time_ns, .at_ns = at_ns};
}

TEST(RelativeTimes, divide_by_the_median_of_two_before_and_one_after) {
  const std::vector<Sample> control = {sample_at(0, 1), sample_at(10, 2), sample_at(20, 4), sample_at(30, 100)};
  const std::vector<Sample> samples = {sample_at(-5, 8), sample_at(9, 8), sample_at(19, 8), sample_at(99, 8)};
  // {1}, {1, 2}, {1, 2, 4}, {4, 100}
  EXPECT_THAT(relative_times(samples, control), ElementsAre(8, 8 / 1.5, 4, 8 / 52.0));
  const std::span<const Sample> so_far(control.data(), 3);
  EXPECT_EQ(relative_times({&samples[2], 1}, so_far), relative_times({&samples[2], 1}, control));  // final
}

// Another part's control samples are of another machine's course: they count alike, whenever they were drawn.
TEST(RelativeTimes, of_a_part_without_control_samples_go_by_those_of_all_parts) {
  std::vector<Sample> control = {sample_at(10, 1), sample_at(5, 4), sample_at(30, 4)};
  control[1].part = control[2].part = 1;
  Sample alone = sample_at(3, 8);
  alone.part = 2;
  EXPECT_THAT(relative_times({&alone, 1}, control), ElementsAre(2));
}

TEST(RelativeTimes, make_do_with_fewer_control_samples) {
  EXPECT_THAT(relative_times(std::vector{sample_at(5, 8)}, std::vector{sample_at(0, 2)}), ElementsAre(4));
}

}  // namespace
}  // namespace reliefbench
