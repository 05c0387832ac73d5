// What maps take on a sweep's devices: bakes by their own bakers, beside the processor's.
#include "tuner/measure/device_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/backend_rig.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"
#include "tuner/measure/merge.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/case.h"
#include "tuner/plan/config.h"
#include "tuner/plan/shard.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

class DeviceBakeTest : public BackendTest {
 protected:
  /// Two formats of one bake, twice each; blocks; a kind without a GPU baker; and heights alone.
  [[nodiscard]] Config config() const {
    std::ofstream(folder_ / "config.json") << R"({
      "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
      "measure": {"samples": 2, "batch_ms": 0.01, "warmup_batches_max": 1},
      "sweeps": [{"technique": "cone", "axes": {"cone_steps": [4, 8], "format": ["rg8", "rg16"]}},
                 {"technique": "cone", "axes": {"format": "bc5"}},
                 {"technique": "distance"},
                 {"technique": "relief", "axes": {"linear_steps": [4]}}]})";
    return load_config(folder_ / "config.json");
  }
  [[nodiscard]] SweepOptions options(const std::string& name, FaultyDevices& devices) const {
    return {.output = folder_ / name,
            .backends = {std::string(row().id)},
            .pictures = Pictured::none,
            .device_bakes = DeviceBakes::always,
            .quiet = true,
            .open = devices.opener(),
            .cooling_pause_s = 0};
  }
  [[nodiscard]] std::vector<Record> records(const std::string& name) const { return load_run(folder_ / name).records; }
  void expect_bakes(const std::string& name) const {
    std::map<std::string, std::set<double>> times;  // by format
    for (const Record& record : records(name)) {
      EXPECT_EQ(record.status, Status::ok) << record.case_id << ": " << record.reason;
      const std::string format(storage_of(settings_of(record.technique, record.params)).format.id);
      EXPECT_EQ(record.device_bake_ns.has_value(), record.technique == "cone" && format != "bc5") << record.case_id;
      if (record.device_bake_ns) times[format].insert(*record.device_bake_ns);
    }
    EXPECT_EQ(times.size(), 2U);
    for (const auto& [format, all] : times) EXPECT_EQ(all.size(), 1U) << format << ": cases of one map agree";
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};
INSTANTIATE_TEST_SUITE_P(Backends, DeviceBakeTest, ::testing::Values("opengl", "vulkan"), backend_name);

constexpr int kBakesOfMap = 6;  // with the one that warms up

TEST_P(DeviceBakeTest, is_measured_once_a_map_and_kept_by_a_resumed_run) {
  FaultyDevices devices;
  static_cast<void>(run_sweep(config(), options("run", devices)));
  expect_bakes("run");
  EXPECT_EQ(devices.calls(FaultyDevices::compute), 2 * kBakesOfMap);

  // A kill that left two records, of one map: that is not baked again, though the map comes from the cache.
  const std::filesystem::path file = folder_ / "run" / kResultsFile;
  std::ifstream in(file);
  std::vector<std::string> kept;
  for (std::string line; std::getline(in, line);)
    if (line.find("format=rg8&") != std::string::npos && line.find("cone_steps=4&") != std::string::npos)
      kept.push_back(line);
  in.close();
  ASSERT_EQ(kept.size(), 1U);
  std::ofstream(file) << kept[0] << '\n';
  FaultyDevices again;
  static_cast<void>(run_sweep(config(), options("run", again)));
  expect_bakes("run");
  EXPECT_EQ(again.calls(FaultyDevices::compute), kBakesOfMap);
}

TEST_P(DeviceBakeTest, is_left_out_on_software_unless_asked) {
  for (const DeviceBakes wanted : {DeviceBakes::hardware, DeviceBakes::never}) {
    FaultyDevices devices;
    SweepOptions asked = options(wanted == DeviceBakes::never ? "never" : "hardware", devices);
    asked.device_bakes = wanted;
    static_cast<void>(run_sweep(config(), asked));
    EXPECT_EQ(devices.calls(FaultyDevices::compute), 0);
    for (const Record& record : records(asked.output.filename())) EXPECT_FALSE(record.device_bake_ns);
  }
}

TEST_P(DeviceBakeTest, a_device_that_is_lost_or_refuses_costs_the_figure_alone) {
  for (const Fault fault : {Fault::device_lost, Fault::other}) {
    FaultyDevices devices;
    devices.fail(FaultyDevices::compute, 0, fault);
    const std::string name = fault == Fault::other ? "refused" : "lost";
    static_cast<void>(run_sweep(config(), options(name, devices)));
    EXPECT_EQ(devices.calls(FaultyDevices::open), fault == Fault::other ? 1 : 2);
    int timed = 0;
    for (const Record& record : records(name)) {
      EXPECT_EQ(record.status, Status::ok) << record.case_id << ": " << record.reason;
      timed += record.device_bake_ns ? 1 : 0;
    }
    EXPECT_EQ(timed, 2) << "of the other format";
  }
}

TEST_P(DeviceBakeTest, is_kept_by_a_merge) {
  FaultyDevices devices;
  for (const char* shard : {"1/2", "2/2"}) {
    SweepOptions part = options(std::string("part") + shard[0], devices);
    part.shard = parse_shard(shard);
    static_cast<void>(run_sweep(config(), part));
  }
  const std::vector<std::filesystem::path> parts{folder_ / "part1", folder_ / "part2"};
  static_cast<void>(merge_runs(parts, folder_ / "whole"));
  // Each part's machine has its own time of a map.
  const auto times = [&](std::initializer_list<const char*> runs) {
    std::map<std::string, std::optional<double>> all;
    for (const char* run : runs)
      for (const Record& record : records(run)) all[record.case_id] = record.device_bake_ns;
    return all;
  };
  EXPECT_EQ(times({"whole"}), times({"part1", "part2"}));
  EXPECT_EQ(std::ranges::count_if(times({"whole"}), [](const auto& one) { return one.second.has_value(); }), 4);
}

TEST(DeviceBakes, ADeviceWithoutComputeHasNone) {
  const TempFolder folder;
  const OwnCache cache(folder / "cache");
  const Config smoke = load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
  const SweepSummary summary = run_sweep(smoke, {.output = folder / "run",
                                                 .backends = {"null"},
                                                 .pictures = Pictured::none,
                                                 .device_bakes = DeviceBakes::always,
                                                 .quiet = true});
  EXPECT_EQ(summary.statuses, (std::map<std::string, int>{{"ok", summary.cases}}));
  for (const Record& record : load_run(folder / "run").records) EXPECT_FALSE(record.device_bake_ns) << record.case_id;
}

}  // namespace
}  // namespace reliefbench
