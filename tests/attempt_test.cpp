// Devices that are lost under claims, `require` and pictures: they are opened again, what lost them is drawn once more,
// and what can't be drawn at all is said and left out.
#include "tuner/measure/attempt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/base/file_error.h"
#include "tests/faulty_device.h"
#include "tests/made_claim.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/measure/claims.h"
#include "tuner/measure/require_run.h"
#include "tuner/measure/sweep.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

class AttemptTest : public ::testing::Test {
 protected:
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(AttemptTest, opens_a_lost_device_once_more_and_no_other) {
  FaultyDevices devices;
  WallSplit split;
  Session session(find_backend("null"), 0, split, {.open = devices.opener()});
  int works = 0;
  int releases = 0;
  const auto failing = [&](int times, Fault fault) {
    works = 0;
    releases = 0;
    return attempt(
        session,
        [&, times, fault] {
          if (works++ < times) fail_device(fault, "words");
        },
        [&] { ++releases; });
  };
  EXPECT_EQ(failing(0, Fault::device_lost), "");
  EXPECT_EQ(releases, 0);
  EXPECT_EQ(failing(1, Fault::device_lost), "");
  EXPECT_EQ(releases, 1);
  EXPECT_EQ(devices.calls(FaultyDevices::open), 2);
  EXPECT_EQ(failing(2, Fault::device_lost), "device_lost: words");
  EXPECT_EQ(releases, 2);
  EXPECT_EQ(devices.calls(FaultyDevices::open), 4) << "it is to be used again";
  EXPECT_EQ(failing(1, Fault::out_of_memory), "out_of_memory: words");
  EXPECT_EQ(works, 1);
  EXPECT_EQ(failing(1, Fault::other), "unsupported: words");
  Record record;
  record.status = Status::timeout;
  record.reason = "slow";
  EXPECT_EQ(attempt(session, [&] { throw CaseFailed(record); }), "timeout: slow");
  EXPECT_EQ(attempt(session, [] { throw std::bad_alloc(); }), "out_of_memory: the host's memory is used up");
  EXPECT_EQ(devices.calls(FaultyDevices::open), 4);
}

TEST_F(AttemptTest, says_nothing_of_bad_input_and_full_disks) {
  WallSplit split;
  Session session(find_backend("null"), 0, split);
  EXPECT_THAT([&] { (void)attempt(session, [] { fail_input("a line"); }); }, ThrowsMessage<Error>("a line"));
  EXPECT_THROW((void)attempt(session, [] { fail_file("disk", "cannot be written", ENOSPC); }), FileError);
}

/// Two claims on the null backend, all of whose checks hold.
std::vector<ClaimVerdict> verdicts_on(FaultyDevices& devices, std::vector<ClaimResult>& results) {
  static const std::vector<Claim> claims{parse_claim(made_claim(), "x.json"), parse_claim(made_claim(), "y.json")};
  devices.be_hardware();
  results = run_claims(claims, {.backends = {"null"}, .quiet = true, .open = devices.opener(), .cooling_pause_s = 0});
  std::vector<ClaimVerdict> verdicts;
  for (const ClaimResult& result : results)
    for (const ClaimAnswer& answer : result.answers) verdicts.push_back(answer.verdict);
  return verdicts;
}

/// Up to where a run's first case is drawn, opened: so many times again.
int draws_before_cases(int opened = 0) {
  FaultyDevices devices;
  WallSplit split;
  Session session(find_backend("null"), 0, split, {.open = devices.opener()});
  session.calibrate(5, nullptr);
  for (int i = 0; i < opened; ++i) session.reopen();
  return devices.calls(FaultyDevices::draw);
}

TEST_F(AttemptTest, a_claim_goes_on_where_its_device_is_lost_once) {
  FaultyDevices counted;
  std::vector<ClaimResult> results;
  ASSERT_THAT(verdicts_on(counted, results), Each(ClaimVerdict::reproduced));
  const int before = draws_before_cases();
  const int draws = counted.calls(FaultyDevices::draw);
  for (int nth = before; nth < draws; nth += (draws - before) / 7) {
    FaultyDevices devices;
    devices.fail(FaultyDevices::draw, nth, Fault::device_lost);
    EXPECT_THAT(verdicts_on(devices, results), Each(ClaimVerdict::reproduced)) << nth;
    EXPECT_EQ(devices.calls(FaultyDevices::open), 2) << nth;
  }
}

TEST_F(AttemptTest, a_claim_that_loses_its_device_twice_is_not_testable_and_costs_no_other) {
  FaultyDevices devices;
  devices.fail(FaultyDevices::draw, draws_before_cases(), Fault::device_lost);
  devices.fail(FaultyDevices::draw, draws_before_cases(1) + 1, Fault::device_lost);
  std::vector<ClaimResult> results;
  const std::vector<ClaimVerdict> verdicts = verdicts_on(devices, results);
  EXPECT_THAT(verdicts, ::testing::ElementsAre(ClaimVerdict::not_testable, ClaimVerdict::not_testable,
                                               ClaimVerdict::reproduced, ClaimVerdict::reproduced));
  EXPECT_EQ(results[0].answers[0].numbers, "spikes_16x16/oblique: device_lost: injected");
  const nlohmann::json json = claims_json(results);
  EXPECT_TRUE(json[0]["rows"].empty());
  EXPECT_EQ(json[1]["rows"].size(), 2U);
}

SceneFile small_scene() {
  return parse_scene_file(R"({"scenes": {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique",
    "frame_px": [24, 24]}, "features": {"shadow": ["linear"], "lod": [], "fade": [], "normals": []},
    "visible": "flip<=0.9", "measure": {"samples": 3}})",
                          "s.json");
}

RequireReport required_on(FaultyDevices& devices) {
  return run_require(small_scene(), {.backend = "null", .has_pictures = true, .quiet = true, .open = devices.opener()});
}

TEST_F(AttemptTest, what_a_scene_requires_is_the_same_where_the_device_is_lost_once) {
  FaultyDevices counted;
  const RequireReport whole = required_on(counted);
  const int draws = counted.calls(FaultyDevices::draw);
  for (int nth = draws - 12; nth > draws / 2; nth -= draws / 16) {
    SCOPED_TRACE(nth);
    FaultyDevices devices;
    devices.fail(FaultyDevices::draw, nth, Fault::timeout);
    const RequireReport report = required_on(devices);
    EXPECT_EQ(devices.calls(FaultyDevices::open), 2);
    EXPECT_EQ(report.answer, whole.answer);
    EXPECT_EQ(report.frame_time_ns.n, 3);
    EXPECT_TRUE(report.failed.empty());
    ASSERT_EQ(report.seen.size(), whole.seen.size());
    for (std::size_t i = 0; i < whole.seen.size(); ++i) EXPECT_EQ(report.seen[i].value, whole.seen[i].value);
  }
}

TEST_F(AttemptTest, sets_that_can_not_be_drawn_are_not_the_answer) {
  FaultyDevices counted;
  const RequireReport whole = required_on(counted);
  EXPECT_EQ(whole.answer, 0U) << "all of it is within the bound";
  bool was_the_answer = false;
  for (int nth = 0; nth < counted.calls(FaultyDevices::compile) && !was_the_answer; ++nth) {
    FaultyDevices devices;
    devices.fail(FaultyDevices::compile, nth, Fault::other);
    try {
      const RequireReport report = required_on(devices);
      EXPECT_EQ(schema_errors(require_json(report), "require"), "");
      if (report.failed.size() != 1 || report.failed[0].settings.technique().id != "flat") continue;
      was_the_answer = true;
      EXPECT_EQ(report.failed[0].reason, "fbm_16x16/oblique: compile_error: injected");
      EXPECT_NE(report.answer, 0U);
      EXPECT_EQ(report.seen.size(), whole.seen.size() - 1);
      EXPECT_EQ(require_json(report)["failed"].size(), 1U);
    } catch (const Error& error) {  // what the session itself compiles
      EXPECT_STREQ(error.what(), "injected");
    }
  }
  EXPECT_TRUE(was_the_answer);
}

TEST_F(AttemptTest, where_no_set_can_be_drawn_there_is_no_answer) {
  FaultyDevices devices;
  for (int nth = 0; nth < 1000; ++nth) devices.fail(FaultyDevices::upload, nth, Fault::out_of_memory);
  EXPECT_THAT([&] { (void)required_on(devices); },
              ThrowsMessage<Error>(StartsWith("no set of features can be drawn: fbm_16x16/oblique: out_of_memory")));
}

// A case whose pictures take the machine with them stays what it was measured to be, and is pictured no more.
TEST_F(AttemptTest, ends_in_pictures_are_not_their_case_s) {
  const Config config = load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
  const std::filesystem::path run = folder_ / "run";
  const auto swept = [&] {
    testing::internal::CaptureStderr();
    const SweepSummary summary =
        run_sweep(config, {.output = run, .backends = {"null"}, .pictures = Pictured::all, .cooling_pause_s = 0});
    EXPECT_EQ(summary.statuses.size(), 1U);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(swept(), Not(HasSubstr("no pictures of")));
  const std::string results = read_file(run / kResultsFile);
  const std::string id = load_run(run).records.front().case_id;
  const auto pictures = [&] { return std::distance(std::filesystem::directory_iterator(run / kImagesFolder), {}); };
  const auto all = pictures();
  const auto killed_after = [&](int times) {
    std::filesystem::remove_all(run / kImagesFolder);
    std::ofstream(run / kMarkFile) << times - 1 << " pictures of " << id << '\n';
  };
  killed_after(1);
  EXPECT_THAT(swept(), Not(HasSubstr("no pictures of"))) << "power may have failed";
  EXPECT_EQ(pictures(), all);
  killed_after(2);
  EXPECT_THAT(swept(), HasSubstr("no pictures of " + id + ": the process ended 2 times in them"));
  EXPECT_LT(pictures(), all);
  EXPECT_EQ(read_file(run / kResultsFile), results);
  EXPECT_THAT(swept(), Not(HasSubstr("no pictures of"))) << "who asks again is obeyed";
  EXPECT_EQ(pictures(), all);
}

}  // namespace
}  // namespace reliefbench
