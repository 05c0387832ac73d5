// Devices that fail under a sweep or a tuning: which case that costs, and what a new start makes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Statuses = std::map<std::string, int>;

class DeviceFault : public ::testing::Test {
 protected:
  [[nodiscard]] static Config smoke() {
    return load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
  }
  /// Without pictures, which no case fails for (SweepTest).
  Statuses sweep(const std::string& name, FaultyDevices& devices, const Config& config = smoke()) const {
    return run_sweep(config, {.output = folder_ / name,
                              .backends = {"null"},
                              .pictures = Pictured::none,
                              .quiet = true,
                              .open = devices.opener(),
                              .cooling_pause_s = 0})
        .statuses;
  }
  Statuses sweep(const std::string& name) const {
    FaultyDevices healthy;
    return sweep(name, healthy);
  }
  /// Calls up to where the first case begins.
  [[nodiscard]] static int calls_before_cases(FaultyDevices::Call call) {
    FaultyDevices devices;
    WallSplit split;
    Session session(find_backend("null"), 0, split, {.open = devices.opener()});
    session.calibrate(smoke().measure.batch_ms, nullptr);
    return devices.calls(call);
  }
  [[nodiscard]] std::map<std::string, double> errors(const std::string& name) const {
    std::map<std::string, double> errors;
    for (const Record& record : load_run(folder_ / name).records)
      if (record.status == Status::ok) errors[record.case_id] = record.error->at("e_xy.p99");
    return errors;
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(DeviceFault, a_device_that_is_lost_or_hangs_is_opened_again_and_only_the_case_of_it_fails) {
  FaultyDevices counted;
  const Statuses whole = sweep("whole", counted);
  ASSERT_EQ(whole.size(), 1U);
  const int cases = whole.at("ok");
  const std::map<std::string, double> whole_errors = errors("whole");
  struct Row {
    Fault fault;
    std::string status;
    int step;
  };
  for (const Row& row : {Row{Fault::device_lost, "device_lost", 9}, Row{Fault::timeout, "timeout", 11}}) {
    int with_a_case = 0;
    for (int nth = calls_before_cases(FaultyDevices::draw); nth < counted.calls(FaultyDevices::draw); nth += row.step) {
      const std::string name = row.status + std::to_string(nth);
      SCOPED_TRACE(name);
      FaultyDevices devices;
      devices.fail(FaultyDevices::draw, nth, row.fault);
      Statuses statuses = sweep(name, devices);
      EXPECT_EQ(devices.calls(FaultyDevices::open), 2);
      // Where it was a frame of the control case, no case fails.
      EXPECT_LE(statuses[row.status], 1);
      EXPECT_EQ(statuses["ok"] + statuses[row.status], cases);
      with_a_case += statuses[row.status];
      for (const auto& [id, error] : errors(name)) EXPECT_EQ(error, whole_errors.at(id)) << id;

      EXPECT_EQ(sweep(name), whole);  // the same command tries it again
      EXPECT_EQ(errors(name), whole_errors);
    }
    EXPECT_GT(with_a_case, 3) << row.status;
  }
}

TEST_F(DeviceFault, every_upload_and_compilation_may_lose_the_device) {
  FaultyDevices counted;
  const Statuses whole = sweep("whole", counted);
  for (const FaultyDevices::Call call : {FaultyDevices::upload, FaultyDevices::compile})
    for (int nth = calls_before_cases(call); nth < counted.calls(call); nth += 2) {
      SCOPED_TRACE(nth);
      FaultyDevices devices;
      devices.fail(call, nth, Fault::device_lost);
      const std::string name = std::to_string(call) + "at" + std::to_string(nth);
      const Statuses expected{{"device_lost", 1}, {"ok", whole.at("ok") - 1}};
      EXPECT_EQ(sweep(name, devices), expected);
      EXPECT_EQ(sweep(name), whole);
    }
}

TEST_F(DeviceFault, a_device_that_does_not_come_back_ends_the_sweep_and_loses_nothing) {
  FaultyDevices counted;
  const Statuses whole = sweep("whole", counted);
  FaultyDevices devices;
  devices.fail(FaultyDevices::draw, counted.calls(FaultyDevices::draw) - 2, Fault::device_lost);  // in the last block
  devices.fail(FaultyDevices::open, 1, Fault::other);
  EXPECT_THAT([&] { sweep("run", devices); },
              ThrowsMessage<Error>(AllOf(HasSubstr("null was lost"), HasSubstr("opened again"))));
  EXPECT_GT(load_run(folder_ / "run").records.size(), 0U);
  EXPECT_EQ(sweep("run"), whole);
}

TEST_F(DeviceFault, a_device_that_is_lost_without_end_ends_the_sweep) {
  FaultyDevices devices;
  for (int nth = calls_before_cases(FaultyDevices::draw) + 20; nth < 1000; ++nth)
    devices.fail(FaultyDevices::draw, nth, Fault::device_lost);
  EXPECT_THAT([&] { sweep("run", devices); }, ThrowsMessage<Error>(HasSubstr("was lost")));
}

TEST_F(DeviceFault, memory_that_runs_out_costs_one_case_whatever_wanted_it) {
  FaultyDevices counted;
  const Statuses whole = sweep("whole", counted);
  for (const FaultyDevices::Call call : {FaultyDevices::upload, FaultyDevices::compile, FaultyDevices::draw})
    for (int nth = calls_before_cases(call); nth < counted.calls(call); nth += 13) {
      SCOPED_TRACE(nth);
      FaultyDevices devices;
      devices.fail(call, nth, Fault::out_of_memory);
      const std::string name = std::to_string(call) + "at" + std::to_string(nth);
      const Statuses statuses = sweep(name, devices);
      if (devices.calls(FaultyDevices::open) > 1) {  // the control case's batch, which no case is to blame for
        EXPECT_EQ(call, FaultyDevices::draw);
        EXPECT_EQ(statuses, whole);
      } else {
        EXPECT_EQ(statuses, (Statuses{{"ok", whole.at("ok") - 1}, {"out_of_memory", 1}}));
      }
      EXPECT_EQ(sweep(name), whole);
    }
}

TEST_F(DeviceFault, what_failed_twice_is_left_unless_it_is_asked_for) {
  const int cases = sweep("whole").at("ok");
  const Statuses failed{{"out_of_memory", cases}};
  for (int start = 0; start < 2; ++start) {
    FaultyDevices devices;
    for (int nth = 0; nth < 1000; ++nth) devices.fail(FaultyDevices::upload, nth, Fault::out_of_memory);
    EXPECT_EQ(sweep("run", devices), failed) << start;
  }
  EXPECT_EQ(sweep("run"), failed);
  const SweepSummary again = run_sweep(smoke(), {.output = folder_ / "run",
                                                 .backends = {"null"},
                                                 .retry_failed = true,
                                                 .pictures = Pictured::none,
                                                 .quiet = true});
  EXPECT_EQ(again.statuses, (Statuses{{"ok", cases}}));
  EXPECT_EQ(again.open, 0);
}

TEST_F(DeviceFault, other_failures_have_their_status_and_are_not_tried_again) {
  const int cases = sweep("whole").at("ok");
  struct Row {
    FaultyDevices::Call call;
    Fault fault;
    std::string status;
  };
  for (const Row& row : {Row{FaultyDevices::upload, Fault::other, "unsupported"},
                         Row{FaultyDevices::compile, Fault::other, "compile_error"}}) {
    SCOPED_TRACE(row.status);
    FaultyDevices devices;
    devices.fail(row.call, calls_before_cases(row.call) + 4, row.fault);
    const Statuses expected{{"ok", cases - 1}, {row.status, 1}};
    EXPECT_EQ(sweep(row.status, devices), expected);
    EXPECT_EQ(sweep(row.status), expected);
  }
}

TEST_F(DeviceFault, a_time_of_zero_is_no_time) {
  FaultyDevices counted;
  const int cases = sweep("whole", counted).at("ok");
  bool was_a_case = false;
  for (int nth = counted.calls(FaultyDevices::draw) - 1; nth > 0 && !was_a_case;
       --nth) {  // the last is the control case
    FaultyDevices devices;
    for (const int again : {0, 1}) devices.fail(FaultyDevices::draw, nth + again, Fault::invalid_timer);
    try {
      Statuses statuses = sweep("zero" + std::to_string(nth), devices);
      was_a_case = statuses["invalid_timer"] == 1;
      if (was_a_case) {
        EXPECT_EQ(statuses["ok"], cases - 1);
      }
    } catch (const Error& error) {  // the control case's
      EXPECT_EQ(error.fault(), Fault::invalid_timer);
    }
  }
  EXPECT_TRUE(was_a_case);
}

TEST_F(DeviceFault, one_time_of_zero_costs_nothing_whatever_it_is_of) {
  FaultyDevices counted;
  const Statuses whole = sweep("whole", counted);
  for (int nth = calls_before_cases(FaultyDevices::draw); nth < counted.calls(FaultyDevices::draw); nth += 7) {
    FaultyDevices devices;
    devices.fail(FaultyDevices::draw, nth, Fault::invalid_timer);
    EXPECT_EQ(sweep("zero" + std::to_string(nth), devices), whole) << nth;
  }
}

TEST_F(DeviceFault, a_frame_over_its_time_is_tried_again) {
  FaultyDevices devices;
  Config hasty = smoke();
  hasty.measure.timeout_s = 1e-12;
  const int cases = sweep("whole").at("ok");
  EXPECT_EQ(sweep("run", devices, hasty), (Statuses{{"timeout", cases}}));
  EXPECT_EQ(sweep("run"), (Statuses{{"ok", cases}}));
}

TEST_F(DeviceFault, a_device_at_a_small_part_of_its_speed_is_throttled) {
  FaultyDevices devices;
  devices.slow_down(calls_before_cases(FaultyDevices::draw), 10);
  const int cases = sweep("whole").at("ok");
  EXPECT_EQ(sweep("run", devices), (Statuses{{"throttled", cases}}));
}

TEST_F(DeviceFault, a_sweep_says_how_many_cases_failed_and_how) {
  const std::string config = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json";
  const CommandResult failing =
      run_reliefbench({"sweep", config, "--backend", "null", "--device", "1", "-o", "run", "--quiet"}, folder_.path());
  EXPECT_EQ(failing.exit_code, 0) << failing.err;
  EXPECT_THAT(failing.err, HasSubstr("2 of 9 cases failed: 2 compile_error; the reasons are in"));
  const CommandResult whole =
      run_reliefbench({"sweep", config, "--backend", "null", "-o", "whole", "--quiet"}, folder_.path());
  EXPECT_EQ(whole.err, "");
}

}  // namespace
}  // namespace reliefbench
