// What devices tell of themselves: each source on made-up files or a library of ours.
#include "backends/device_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "backends/backend.h"
#include "tests/schema.h"
#include "tests/scoped_variable.h"
#include "tests/temp_folder.h"
#include "tuner/results/block_state.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;

constexpr const char* kAddress = "0000:65:00.0";

class DeviceStateTest : public ::testing::Test {
 protected:
  void put(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((sysfs_ / file).parent_path());
    std::ofstream(sysfs_ / file) << text;
  }
  void put_pci(const std::string& file, const std::string& text) const {
    put(std::string("bus/pci/devices/") + kAddress + "/" + file, text);
  }
  /// What a new watch reads.
  [[nodiscard]] DeviceState state(const DeviceInfo& device, const std::string& nvml = "no_such_library.so") const {
    return DeviceWatch(device, {.sysfs = sysfs_, .nvml = nvml}).read();
  }
  [[nodiscard]] static DeviceInfo made_device(const std::string& type, const std::string& pci) {
    DeviceInfo device;
    device.type = type;
    device.pci = pci;
    return device;
  }
  const DeviceInfo gpu_ = made_device("discrete", kAddress);
  const DeviceInfo processor_ = made_device("cpu", "");
  const ScopedVariable nvml_{"FAKE_NVML", std::nullopt};
  TempFolder folder_;
  std::filesystem::path sysfs_ = folder_ / "sys";
};

TEST_F(DeviceStateTest, nvml_tells_all_and_only_what_it_knows) {
  nvml_.set("0000:65:00.0 clock=1005 max=1980 temperature=88 power=310500 reasons=0x60");
  const DeviceState all = state(gpu_, RELIEFBENCH_FAKE_NVML);
  EXPECT_EQ(all, (DeviceState{.clock_mhz = 1005,
                              .clock_max_mhz = 1980,
                              .temperature_c = 88,
                              .power_w = 310.5,
                              .throttle_events = {},
                              .held_back = {std::string(kThermalSlowdown)}}));
  EXPECT_EQ(state_text(all), "thermal slowdown, 1005 of 1980 MHz, 88 C, 310 W");

  nvml_.set("0000:65:00.0 clock=0 temperature=4000000000 reasons=0x103");  // idle, set by somebody
  EXPECT_FALSE(state(gpu_, RELIEFBENCH_FAKE_NVML).is_told());
  nvml_.set("0000:65:00.0 reasons=0x8c");
  EXPECT_THAT(state(gpu_, RELIEFBENCH_FAKE_NVML).held_back, ElementsAre(kHardwareSlowdown, kPowerCap));
  nvml_.set("0000:66:00.0 clock=1005");
  EXPECT_FALSE(state(gpu_, RELIEFBENCH_FAKE_NVML).is_told());  // another device's
  EXPECT_FALSE(state(processor_, RELIEFBENCH_FAKE_NVML).is_told());
  nvml_.set(std::nullopt);
  EXPECT_FALSE(state(gpu_, RELIEFBENCH_FAKE_NVML).is_told());      // it does not start
  EXPECT_FALSE(state(gpu_, RELIEFBENCH_DRIVER_FAULTS).is_told());  // a library without its functions
}

TEST_F(DeviceStateTest, amdgpu_tells_by_its_files) {
  put_pci("hwmon/hwmon3/freq1_input", "1005000000\n");
  put_pci("hwmon/hwmon3/temp1_input", "88000\n");
  put_pci("hwmon/hwmon3/power1_average", "310500000\n");
  put_pci("pp_dpm_sclk", "0: 500Mhz *\n1: 2475Mhz\n");
  EXPECT_EQ(state_text(state(gpu_)), "1005 of 2475 MHz, 88 C, 310 W");
  EXPECT_FALSE(state(processor_).is_told());
  // Where NVML tells as well, it comes first, and the files fill up.
  nvml_.set("0000:65:00.0 clock=1500");
  EXPECT_EQ(state_text(state(gpu_, RELIEFBENCH_FAKE_NVML)), "1500 of 2475 MHz, 88 C, 310 W");
}

TEST_F(DeviceStateTest, i915_and_xe_tell_by_their_files) {
  put_pci("drm/card1/gt_act_freq_mhz", "700\n");
  put_pci("drm/card1/gt_max_freq_mhz", "1200\n");
  put_pci("drm/card1/gt_RP0_freq_mhz", "1300\n");
  put_pci("drm/card1/gt/gt0/throttle_reason_status", "1\n");
  put_pci("drm/card1/gt/gt0/throttle_reason_pl1", "1\n");
  put_pci("drm/card1/gt/gt0/throttle_reason_thermal", "0\n");
  EXPECT_EQ(state_text(state(gpu_)), "power cap, 700 of 1300 MHz");
  put_pci("drm/card1/gt_act_freq_mhz", "0\n");  // asleep: no clock at all
  EXPECT_EQ(state_text(state(gpu_)), "power cap, at most 1300 MHz");

  const DeviceInfo other = made_device("discrete", "0000:03:00.0");
  for (const auto& [file, text] : std::map<std::string, std::string>{
           {"act_freq", "2000"}, {"rp0_freq", "2400"}, {"throttle/reason_prochot", "1"}, {"throttle/reason_pl4", "0"}})
    put("bus/pci/devices/0000:03:00.0/tile0/gt0/freq0/" + file, text);
  EXPECT_EQ(state_text(state(other)), "thermal slowdown, 2000 of 2400 MHz");
}

TEST_F(DeviceStateTest, a_software_device_is_the_processor) {
  EXPECT_FALSE(state(processor_).is_told());  // as in most virtual machines
  for (const std::string cpu : {"0", "1", "10"}) {
    put("devices/system/cpu/cpu" + cpu + "/cpufreq/scaling_cur_freq", cpu + "800000\n");
    put("devices/system/cpu/cpu" + cpu + "/cpufreq/cpuinfo_max_freq", "4700000\n");
    put("devices/system/cpu/cpu" + cpu + "/thermal_throttle/core_throttle_count", "2\n");
    put("devices/system/cpu/cpu" + cpu + "/thermal_throttle/package_throttle_count", "1\n");
  }
  put("devices/system/cpu/cpuidle/cpufreq/scaling_cur_freq", "9900000\n");
  put("class/hwmon/hwmon0/name", "nvme\n");
  put("class/hwmon/hwmon0/temp1_input", "99000\n");
  put("class/hwmon/hwmon1/name", "k10temp\n");
  put("class/hwmon/hwmon1/temp1_input", "61500\n");
  EXPECT_EQ(state(processor_), (DeviceState{.clock_mhz = 1800,
                                            .clock_max_mhz = 4700,
                                            .temperature_c = 61.5,
                                            .power_w = {},
                                            .throttle_events = 9,
                                            .held_back = {}}));
  EXPECT_FALSE(state(gpu_).is_told());
}

TEST_F(DeviceStateTest, odd_files_have_no_value) {
  const std::string huge(5000, '9');
  for (const std::string& text :
       {std::string(), std::string("\n"), std::string("fast\n"), std::string("-5000000\n"), huge, std::string("nan"),
        std::string("inf\n"), std::string("1e999\n"), std::string("88000 C\n"), std::string("0x10\n"),
        std::string("1\0002", 3), std::string("999999999999999999999999\n")}) {
    SCOPED_TRACE(text.substr(0, 20));
    for (const char* file : {"freq1_input", "temp1_input", "power1_average", "power1_input"})
      put_pci(std::string("hwmon/hwmon0/") + file, text);
    put_pci("drm/card0/gt_act_freq_mhz", text);
    put_pci("drm/card0/gt/gt0/throttle_reason_thermal", text);
    put_pci("pp_dpm_sclk", text);
    EXPECT_FALSE(state(gpu_).is_told()) << state_text(state(gpu_));
  }
  put_pci("pp_dpm_sclk", "0: Mhz\n: 5Mhz\n1: -7Mhz *\n2: 900MHz\nMhz\n3:");
  EXPECT_EQ(state(gpu_).clock_max_mhz, 900);
  // A file that goes, or a folder in its place, while it is watched.
  DeviceWatch watch(gpu_, {.sysfs = sysfs_, .nvml = ""});
  std::filesystem::remove_all(sysfs_);
  EXPECT_FALSE(watch.read().is_told());
  put_pci("hwmon/hwmon0/temp1_input/deeper", "1");
  EXPECT_FALSE(watch.read().is_told());
}

TEST_F(DeviceStateTest, addresses_lead_nowhere_else) {
  put("secret/hwmon/hwmon0/temp1_input", "50000");
  put("bus/pci/devices/x", "");
  EXPECT_FALSE(state(made_device("discrete", "../../../secret")).is_told());
}

TEST_F(DeviceStateTest, states_go_through_json) {
  const DeviceState whole{.clock_mhz = 1005,
                          .clock_max_mhz = 1980,
                          .temperature_c = 88.5,
                          .power_w = 310,
                          .throttle_events = 7,
                          .held_back = {std::string(kPowerCap), std::string(kThermalSlowdown)}};
  EXPECT_EQ(parse_state(state_json(whole)), whole);
  EXPECT_EQ(state_json({}).dump(), "{}");
  EXPECT_FALSE(parse_state({{"clock_mhz", -3}}).is_told());
  EXPECT_THROW((void)parse_state({{"clock_mhz", "fast"}}), Error);
  EXPECT_THROW((void)parse_state("fast"), Error);

  BlockState block{.backend = "vulkan", .from_ns = 1, .to_ns = 2, .part = 1, .before = whole, .after = whole};
  block.held_back = "thermal slowdown";
  EXPECT_EQ(schema_errors(nlohmann::json(block), "blocks"), "");
  EXPECT_EQ(nlohmann::json(nlohmann::json(block).get<BlockState>()), nlohmann::json(block));
  EXPECT_EQ(schema_errors(nlohmann::json(BlockState{.backend = "null"}), "blocks"), "");
  EXPECT_THROW((void)nlohmann::json({{"backend", "x"}}).get<BlockState>(), Error);
}

}  // namespace
}  // namespace reliefbench
