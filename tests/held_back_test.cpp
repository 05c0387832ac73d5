// Devices that say that they are held back while a block is drawn: it is measured again, and does not count.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tests/written_run.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/merge.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;
using Counts = std::map<std::string, int>;

DeviceState fast() { return {.clock_mhz = 1950, .clock_max_mhz = 1980, .temperature_c = 60}; }
DeviceState hot() {
  return {.clock_mhz = 1005, .clock_max_mhz = 1980, .temperature_c = 88, .held_back = {std::string(kThermalSlowdown)}};
}
constexpr const char* kHot = "thermal slowdown, 1005 of 1980 MHz, 88 C";

TEST(HeldBackBy, says_what_the_device_says) {
  EXPECT_EQ(held_back_by(fast(), fast(), hot(), 1), kHot);
  EXPECT_EQ(held_back_by(fast(), hot(), fast(), 1), "");  // it was, and got over it
  EXPECT_EQ(held_back_by(hot(), hot(), hot(), 1), "");    // calibrated like that
  EXPECT_EQ(held_back_by({}, {}, {}, 1), "");
  EXPECT_EQ(held_back_by({}, {}, hot(), 1), kHot);
  DeviceState hardware = fast();
  hardware.held_back = {std::string(kHardwareSlowdown)};
  EXPECT_EQ(held_back_by(fast(), fast(), hardware, 1), "hardware slowdown, 1950 of 1980 MHz, 60 C");
}

TEST(HeldBackBy, a_power_cap_or_a_clock_alone_is_no_slowdown) {
  DeviceState capped = fast();
  capped.held_back = {std::string(kPowerCap)};
  EXPECT_EQ(held_back_by(fast(), fast(), capped, 1.05), "");
  capped.clock_mhz = 1700;
  EXPECT_EQ(held_back_by(fast(), fast(), capped, 1), "power cap, 1700 of 1980 MHz, 60 C");
  DeviceState idle = fast();
  idle.clock_mhz = 300;
  EXPECT_EQ(held_back_by(fast(), fast(), idle, 1.1), "");
  EXPECT_THAT(held_back_by(fast(), fast(), idle, 1.2),
              StartsWith("a clock of 300 MHz where it was calibrated at 1950"));
  EXPECT_EQ(held_back_by(fast(), fast(), fast(), 3.9), "");  // somebody else's work: the control case takes it out
  EXPECT_THAT(held_back_by(fast(), fast(), fast(), 4.1), HasSubstr("4.1 times slower"));
  EXPECT_EQ(held_back_by(fast(), fast(), fast(), 4.1, 5), "");
}

TEST(HeldBackBy, a_count_of_slowdowns_rises) {
  const DeviceState before{.temperature_c = 70, .throttle_events = 10};
  const DeviceState after{.temperature_c = 95, .throttle_events = 12};
  EXPECT_EQ(held_back_by(before, before, after, 1), "the processor was slowed down 2 times, 95 C");
  EXPECT_EQ(held_back_by(before, after, after, 1), "");
  EXPECT_EQ(held_back_by(before, {}, after, 1), "");
}

/// The smoke config on the null backend: nine cases in blocks of four. States are asked for once in the calibration,
/// and before and after each block.
class HeldBackTest : public ::testing::Test {
 protected:
  static constexpr int kAfterFirstBlock = 2;

  [[nodiscard]] static Config smoke() {
    return load_config(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs/smoke.json");
  }
  SweepSummary summary(const std::string& name, FaultyDevices& devices, std::optional<Shard> shard = {}) const {
    return run_sweep(smoke(), {.output = folder_ / name,
                               .backends = {"null"},
                               .shard = shard,
                               .pictures = Pictured::none,
                               .quiet = true,
                               .open = devices.opener(),
                               .cooling_pause_s = 0});
  }
  Counts sweep(const std::string& name, FaultyDevices& devices, std::optional<Shard> shard = {}) const {
    return summary(name, devices, shard).statuses;
  }
  reliefbench::Run healthy(const std::string& name) const {
    FaultyDevices devices;
    (void)sweep(name, devices);
    return load_run(folder_ / name);
  }
  /// What must be the same however often blocks were drawn.
  static void expect_same(const reliefbench::Run& run, const reliefbench::Run& whole) {
    ASSERT_EQ(run.records.size(), whole.records.size());
    EXPECT_EQ(samples_by_case(run), samples_by_case(whole));
    for (const Record& record : run.records) {
      const auto other = std::ranges::find(whole.records, record.case_id, &Record::case_id);
      ASSERT_NE(other, whole.records.end());
      EXPECT_EQ(record.status, Status::ok) << record.reason;
      EXPECT_EQ(record.error->values, other->error->values);
      EXPECT_EQ(record.frame_time->summary.n, other->frame_time->summary.n);
    }
  }
  static Counts samples_by_case(const reliefbench::Run& run) {
    Counts counts;
    for (const Sample& sample : run.samples) ++counts[sample.case_id];
    return counts;
  }
  [[nodiscard]] std::size_t lines(const std::string& file) const {
    std::ifstream in(folder_ / file);
    return static_cast<std::size_t>(std::count(std::istreambuf_iterator<char>(in), {}, '\n'));
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(HeldBackTest, a_device_that_tells_nothing_leaves_no_trace) {
  const reliefbench::Run run = healthy("run");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run" / kBlocksFile));
  EXPECT_TRUE(run.blocks.empty());
  for (const char* key : {"states", "control_state", "pci"}) EXPECT_FALSE(run.info["devices"][0].contains(key)) << key;
}

TEST_F(HeldBackTest, a_device_that_is_held_back_from_the_start_is_said_to_be) {
  FaultyDevices devices;
  devices.tell([](int /*nth*/) { return hot(); });
  const SweepSummary run = summary("run", devices);
  EXPECT_EQ(run.statuses, (Counts{{"ok", 9}}));
  EXPECT_THAT(run.notes, ::testing::Contains(AllOf(HasSubstr("was held back when the run began"), HasSubstr(kHot))));
  FaultyDevices cool;
  cool.tell([](int /*nth*/) { return fast(); });
  EXPECT_THAT(summary("cool", cool).notes, ::testing::Not(::testing::Contains(HasSubstr("held back"))));
}

TEST_F(HeldBackTest, a_block_that_was_held_back_once_is_measured_again) {
  const reliefbench::Run whole = healthy("whole");
  FaultyDevices devices;
  devices.tell([](int nth) { return nth == kAfterFirstBlock ? hot() : fast(); });
  EXPECT_EQ(sweep("run", devices), (Counts{{"ok", 9}}));
  EXPECT_EQ(devices.states_told(), 1 + 2 * 4);  // never in a block
  const reliefbench::Run run = load_run(folder_ / "run");
  expect_same(run, whole);
  ASSERT_EQ(run.blocks.size(), 4U);
  for (const BlockState& block : run.blocks) EXPECT_EQ(schema_errors(nlohmann::json(block), "blocks"), "");
  EXPECT_EQ(run.blocks[0].held_back, kHot);
  EXPECT_EQ(run.blocks[1].held_back, "");
  EXPECT_GT(lines("run/samples.jsonl"), run.samples.size());  // what does not count is kept

  EXPECT_EQ(schema_errors(run.info, "run"), "");
  const nlohmann::json& device = run.info["devices"][0];
  EXPECT_EQ(device["control_state"]["clock_mhz"], 1950);
  EXPECT_EQ(device["states"]["clock_mhz"], (nlohmann::json{1005, 1950}));
  EXPECT_EQ(device["states"]["held_back"], nlohmann::json::array({kThermalSlowdown}));
  EXPECT_EQ(device["states"]["blocks_held_back"], 1);
  EXPECT_EQ(device["states"]["blocks"], 4);

  // A run with states beside one without.
  for (const auto& [a, b] : {std::pair("run", "whole"), std::pair("whole", "run")}) {
    const CommandResult compared = run_reliefbench({"compare", a, b}, folder_.path());
    EXPECT_LE(compared.exit_code, 1) << compared.err;
    EXPECT_THAT(compared.out, HasSubstr("9")) << compared.err;
  }
}

TEST_F(HeldBackTest, what_stays_held_back_is_throttled_and_the_next_start_measures_it) {
  const reliefbench::Run whole = healthy("whole");
  FaultyDevices devices;
  devices.tell([](int nth) { return nth == 2 || nth == 4 || nth == 6 ? hot() : fast(); });
  EXPECT_EQ(sweep("run", devices), (Counts{{"ok", 5}, {"throttled", 4}}));
  const reliefbench::Run run = load_run(folder_ / "run");
  for (const Record& record : run.records) {
    EXPECT_EQ(schema_errors(nlohmann::json(record), "results"), "");
    if (record.status == Status::ok) continue;
    EXPECT_EQ(record.reason, kHot);
    EXPECT_FALSE(record.frame_time);
    EXPECT_FALSE(samples_by_case(run).contains(record.case_id));
  }
  FaultyDevices again;
  again.tell([](int /*nth*/) { return fast(); });
  EXPECT_EQ(sweep("run", again), (Counts{{"ok", 9}}));
  EXPECT_EQ(again.states_told(), 2 * 4);  // its calibration is known; each of the four alone
  const reliefbench::Run after = load_run(folder_ / "run");
  EXPECT_EQ(after.info["devices"][0]["control_state"]["clock_mhz"], 1950);
  for (const Record& record : after.records)
    EXPECT_EQ(record.frame_time->summary.n, whole.records.front().frame_time->summary.n);
}

// Killed between its samples and its record, a case has them still.
TEST_F(HeldBackTest, what_an_earlier_start_has_drawn_all_of_is_not_throttled) {
  reliefbench::Run run = healthy("run");
  const std::string drawn = run.records[0].case_id;
  const std::string undrawn = run.records[1].case_id;
  run.records.erase(run.records.begin(), run.records.begin() + 2);
  std::erase_if(run.samples, [&](const Sample& sample) { return sample.case_id == undrawn; });
  write_run(run);
  FaultyDevices devices;
  devices.tell([](int nth) { return nth % 2 == 0 ? fast() : hot(); });
  EXPECT_EQ(sweep("run", devices), (Counts{{"ok", 8}, {"throttled", 1}}));
  for (const Record& record : load_run(folder_ / "run").records)
    EXPECT_EQ(record.status == Status::ok, record.case_id != undrawn) << record.case_id;
}

TEST_F(HeldBackTest, a_slow_control_case_is_measured_again_before_it_is_believed) {
  FaultyDevices counted;
  std::map<int, int> draws;
  counted.tell([&](int nth) {
    draws[nth] = counted.calls(FaultyDevices::draw);
    return DeviceState{};
  });
  (void)sweep("counted", counted);
  FaultyDevices devices;
  devices.slow_down(draws.at(1), 10, draws.at(kAfterFirstBlock));
  EXPECT_EQ(sweep("run", devices), (Counts{{"ok", 9}}));
  const reliefbench::Run run = load_run(folder_ / "run");
  expect_same(run, load_run(folder_ / "counted"));
  ASSERT_EQ(run.blocks.size(), 1U);  // the others have nothing to tell
  EXPECT_THAT(run.blocks.front().held_back, HasSubstr("10.0 times slower"));
}

TEST_F(HeldBackTest, a_device_that_is_lost_in_such_a_block_is_opened_again) {
  FaultyDevices counted;
  std::map<int, int> draws;
  counted.tell([&](int nth) {
    draws[nth] = counted.calls(FaultyDevices::draw);
    return fast();
  });
  (void)sweep("counted", counted);
  FaultyDevices devices;
  devices.tell([](int nth) { return nth == kAfterFirstBlock ? hot() : fast(); });
  devices.fail(FaultyDevices::draw, draws.at(kAfterFirstBlock) - 3, Fault::device_lost);
  Counts statuses = sweep("run", devices);
  EXPECT_EQ(devices.calls(FaultyDevices::open), 2);
  EXPECT_EQ(statuses["ok"] + statuses["device_lost"], 9);
  const reliefbench::Run run = load_run(folder_ / "run");
  EXPECT_EQ(run.blocks.front().held_back, kHot);
  for (const Record& record : run.records)
    if (record.status == Status::ok) {
      EXPECT_EQ(record.frame_time->summary.n, smoke().measure.samples);
    }
}

TEST_F(HeldBackTest, shards_keep_their_states_when_they_are_merged) {
  const reliefbench::Run whole = healthy("whole");
  std::vector<std::filesystem::path> folders;
  for (int index = 1; index <= 3; ++index) {
    FaultyDevices devices;
    if (index > 1) devices.tell([&](int nth) { return nth == kAfterFirstBlock && index == 3 ? hot() : fast(); });
    (void)sweep("s" + std::to_string(index), devices, Shard{.index = index, .of = 3});
    folders.push_back(folder_ / ("s" + std::to_string(index)));
  }
  const reliefbench::Run merged = merge_runs(folders, folder_ / "merged").run;
  const reliefbench::Run read = load_run(folder_ / "merged");
  EXPECT_EQ(read.samples.size(), merged.samples.size());
  ASSERT_EQ(read.blocks.size(), 3U);
  EXPECT_EQ(read.blocks[0].part, 1);
  EXPECT_EQ(read.blocks[1].part, 2);
  EXPECT_EQ(read.blocks[1].held_back, kHot);
  EXPECT_EQ(read.info["devices"][0]["states"]["blocks"], 3);
  EXPECT_EQ(schema_errors(read.info, "run"), "");
  for (const Record& record : read.records) {
    EXPECT_EQ(record.status, Status::ok);
    EXPECT_EQ(samples_by_case(read).at(record.case_id), samples_by_case(whole).at(record.case_id));
  }
}

TEST_F(HeldBackTest, odd_lines_are_refused_with_their_place) {
  FaultyDevices devices;
  devices.tell([](int /*nth*/) { return fast(); });
  (void)sweep("run", devices);
  std::ofstream(folder_ / "run/blocks.jsonl", std::ios::app) << "{\"backend\": \"null\", \"from_n";  // torn
  EXPECT_EQ(load_run(folder_ / "run").blocks.size(), 3U);
  std::ofstream(folder_ / "run/blocks.jsonl", std::ios::app) << "s\": \"soon\"}\n";
  EXPECT_THAT([&] { (void)load_run(folder_ / "run"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("blocks.jsonl:4: "), HasSubstr("'from_ns'"))));
}

constexpr std::string_view kTuned = R"({
  "scenes": [{"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": "oblique", "frame_px": [32, 32]}],
  "measure": {"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 2, "control_every": 2, "block_cases": 4},
  "sweeps": [{"technique": "relief", "axes": {"linear_steps": {"from": 4, "to": 64, "times": 2}}}]
})";

TEST_F(HeldBackTest, a_tuning_draws_again_and_ends_where_that_does_not_help) {
  const Config config = parse_config(std::string(kTuned), "held_back_test.json");
  const auto tune = [&](const std::string& name, const std::function<DeviceState(int)>& states) {
    FaultyDevices devices;
    devices.tell(states);
    TuneOptions options;
    options.output = folder_ / name;
    options.backend = "null";
    options.quiet = true;
    options.open = devices.opener();
    options.cooling_pause_s = 0;
    return run_tune(config, options);
  };
  const auto picks = [](const TuneResult& result) {
    std::vector<std::string> ids;
    for (const BudgetAnswer& answer : result.search.answers) ids.push_back(result.space.candidates[answer.pick].id);
    return ids;
  };
  const TuneResult whole = tune("whole", [](int /*nth*/) { return fast(); });
  const TuneResult once = tune("once", [](int nth) { return nth == 2 || nth == 8 ? hot() : fast(); });
  EXPECT_EQ(picks(once), picks(whole));
  EXPECT_TRUE(once.is_certified());
  const reliefbench::Run run = load_run(folder_ / "once");
  EXPECT_EQ(std::ranges::count(run.blocks, kHot, &BlockState::held_back), 2);
  EXPECT_EQ(run.info["devices"][0]["states"]["blocks_held_back"], 2);
  EXPECT_GT(lines("once/samples.jsonl"), run.samples.size());

  EXPECT_THAT([&] { (void)tune("stays", [](int nth) { return nth > 4 ? hot() : fast(); }); },
              ThrowsMessage<Error>(AllOf(HasSubstr("null is held back: "), HasSubstr(kHot))));
  EXPECT_EQ(picks(tune("stays", [](int /*nth*/) { return fast(); })), picks(whole));
}

}  // namespace
}  // namespace reliefbench
