// What is made of devices that are held back, beside sweeps and tunings: they are given time to cool, claims are not
// decided by their times, and no set of features is picked by them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/faulty_device.h"
#include "tests/made_claim.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/measure/claims.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/require_run.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kTooHot = "thermal slowdown, 1005 of 1980 MHz, 88 C";

/// Hot whenever its state is asked for the n-th time, the calibration's being the 0th.
template <typename IsHot>
std::function<DeviceState(int)> hot_when(IsHot is_hot) {
  return [=](int nth) -> DeviceState {
    if (!is_hot(nth)) return {.clock_mhz = 1950, .clock_max_mhz = 1980, .temperature_c = 60};
    return {
        .clock_mhz = 1005, .clock_max_mhz = 1980, .temperature_c = 88, .held_back = {std::string(kThermalSlowdown)}};
  };
}

class ThrottledTest : public ::testing::Test {
 protected:
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST(ProgressWaits, are_shown_at_once) {
  testing::internal::CaptureStderr();
  {
    Progress progress(false);
    progress.update(0.25, "cases");
    progress.update(0.5, "cases");  // too soon to be shown
    progress.wait("it cools");
    Progress(true).wait("quietly");
  }
  const std::string shown = testing::internal::GetCapturedStderr();
  EXPECT_THAT(shown, AllOf(HasSubstr(" 25 %"), HasSubstr(" 50 %"), HasSubstr("it cools\n")));
  EXPECT_THAT(shown, ::testing::Not(HasSubstr("quietly")));
}

TEST_F(ThrottledTest, the_pause_is_shown_and_has_its_part_of_the_wall_time) {
  FaultyDevices devices;
  devices.tell(hot_when([](int nth) { return nth == 2; }));
  testing::internal::CaptureStderr();
  const SweepSummary summary = run_sweep(
      load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json"), {.output = folder_ / "run",
                                                                                          .backends = {"null"},
                                                                                          .pictures = Pictured::none,
                                                                                          .open = devices.opener(),
                                                                                          .cooling_pause_s = 0.25});
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              HasSubstr(std::string("null is cooling for 0.25 s: ") + kTooHot + "\n"));
  EXPECT_GE(summary.part_s.at(static_cast<std::size_t>(Part::cooling)), 0.25);
  const reliefbench::Run run = load_run(folder_ / "run");
  EXPECT_EQ(schema_errors(run.info, "run"), "");
  EXPECT_GE(run.info["wall_s"]["cooling"], 0.25);
  double sum_s = 0;
  for (const auto& part : run.info["wall_s"].items()) sum_s += part.key() == "total" ? 0 : part.value().get<double>();
  EXPECT_NEAR(sum_s, run.info["wall_s"]["total"].get<double>(), 1e-6);
}

const std::string kClaim = made_claim(R"(,
           {"says": "beaten", "metric": "missed_rate", "of": "few", "beaten_by": ["cones"]})");

std::vector<ClaimResult> claims_on(FaultyDevices& devices, std::vector<Claim>& claims) {
  devices.be_hardware();
  return run_claims(claims, {.backends = {"null"}, .quiet = true, .open = devices.opener(), .cooling_pause_s = 0});
}

TEST_F(ThrottledTest, claims_are_timed_again) {
  std::vector<Claim> claims{parse_claim(kClaim, "x.json")};
  FaultyDevices devices;
  devices.tell(hot_when([](int nth) { return nth == 2; }));
  const std::vector<ClaimResult> results = claims_on(devices, claims);
  EXPECT_EQ(devices.states_told(), 1 + 2 * 2);
  EXPECT_EQ(results[0].answers[1].verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(results[0].scenes[0].held_back, "");
  for (const ClaimFigures& row : results[0].scenes[0].rows) EXPECT_EQ(row.times_ns.size(), 9U);
}

TEST_F(ThrottledTest, claims_that_rest_on_such_times_are_not_decided) {
  std::vector<Claim> claims{parse_claim(kClaim, "x.json")};
  FaultyDevices devices;
  devices.tell(hot_when([](int nth) { return nth > 0; }));
  const std::vector<ClaimResult> results = claims_on(devices, claims);
  EXPECT_EQ(devices.states_told(), 1 + 2 * (1 + kMostAgain));
  EXPECT_EQ(results[0].answers[0].verdict, ClaimVerdict::reproduced);  // errors are what they are
  for (const std::size_t check : {1, 2}) {
    EXPECT_EQ(results[0].answers[check].verdict, ClaimVerdict::throttled);
    EXPECT_EQ(results[0].answers[check].numbers, std::string("spikes_16x16/oblique: ") + kTooHot);
  }
  const nlohmann::json out = claims_json(results);
  EXPECT_EQ(out[0]["checks"][1]["verdict"], "throttled");
  EXPECT_FALSE(out[0]["rows"][0]["ours"].contains("frame_time"));
  EXPECT_TRUE(out[0]["rows"][0]["ours"].contains("missed_rate"));
}

SceneFile scene_file() {
  return parse_scene_file(R"({"scenes": {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique",
    "frame_px": [24, 24]}, "features": {"shadow": ["linear"], "lod": [], "fade": [], "normals": []},
    "visible": "flip<=0.9", "measure": {"samples": 3}})",
                          "s.json");
}

RequireReport required(FaultyDevices& devices, const SceneFile& file, const std::string& backend = "null") {
  return run_require(file, {.backend = backend, .quiet = true, .open = devices.opener(), .cooling_pause_s = 0});
}

TEST_F(ThrottledTest, features_are_timed_again) {
  FaultyDevices devices;
  devices.tell(hot_when([](int nth) { return nth == 2; }));
  const RequireReport report = required(devices, scene_file());
  EXPECT_EQ(devices.states_told(), 1 + 2 * 2);
  EXPECT_EQ(report.times_held_back, "");
  EXPECT_EQ(report.frame_time_ns.n, 3);
  EXPECT_FALSE(require_json(report).contains("held_back"));
}

TEST_F(ThrottledTest, features_have_no_price_by_such_times) {
  FaultyDevices devices;
  devices.tell(hot_when([](int nth) { return nth > 0; }));
  const RequireReport report = required(devices, scene_file());
  EXPECT_TRUE(report.is_met);
  EXPECT_EQ(report.times_held_back, kTooHot);
  EXPECT_EQ(report.frame_time_ns.n, 0);
  ASSERT_FALSE(report.worth.empty());
  for (const FeatureWorth& worth : report.worth) EXPECT_EQ(worth.price_ns.n, 0);
  const nlohmann::json json = require_json(report);
  EXPECT_EQ(schema_errors(json, "require"), "");
  EXPECT_EQ(json["held_back"]["times"], kTooHot);
  EXPECT_FALSE(json["answer"].contains("frame_time_ns"));
  EXPECT_FALSE(json["features"][0].contains("price_ns"));
}

TEST_F(ThrottledTest, no_set_is_picked_by_such_times) {
  if (find_backend("opengl").devices().empty()) GTEST_SKIP() << "no device";
  // Minified, so that levels of normals come nearer to the reference, too.
  SceneFile file = parse_scene_file(R"({"scenes": {"heightmap": {"source": "fbm", "width": 32, "height": 32},
    "views": "grazing", "tiling": 3, "reference": "supersampled_complete", "frame_px": [24, 24]},
    "features": {"shadow": [], "lod": [], "fade": []}, "measure": {"samples": 3}})",
                                    "s.json");
  FaultyDevices healthy;
  const RequireReport all = required(healthy, file, "opengl");
  double worst_of_one = 0;
  for (const SeenSet& seen : all.seen)
    if (size_of(seen.set) == 1) worst_of_one = std::max(worst_of_one, seen.value);
  ASSERT_LT(worst_of_one, all.at(0).value);
  file.visible.limit = worst_of_one;
  FaultyDevices hot;
  hot.tell(hot_when([](int nth) { return nth > 0 && nth <= 2 * (1 + kMostAgain); }));
  const RequireReport report = required(hot, file, "opengl");
  ASSERT_GT(report.ties.size(), 1U);
  EXPECT_EQ(report.ties_held_back, kTooHot);
  EXPECT_EQ(report.times_held_back, "");
  EXPECT_EQ(report.answer, report.ties.front());
  EXPECT_EQ(report.frame_time_ns.n, 3);
  const nlohmann::json json = require_json(report);
  EXPECT_EQ(schema_errors(json, "require"), "");
  EXPECT_EQ(json["held_back"], (nlohmann::json{{"ties", kTooHot}}));
}

}  // namespace
}  // namespace reliefbench
