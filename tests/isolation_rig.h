#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/forwarding_backend.h"
#include "tests/own_cache.h"
#include "tests/remote_device.h"
#include "tests/temp_folder.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {

using StatusByTechnique = std::map<std::string, std::string>;

constexpr int kLost = 0;  // in a signal's place: the driver says itself that the device is lost

/// Which batches, from 0, get what signal.
struct Strike {
  std::vector<int> at;
  int signal;
};

/// A device in a worker, which gets a signal in some of its batches. It has one timer: each takes its time to audit.
class StruckDevice final : public ForwardingBackend {
 public:
  /// process: the worker's; batches: counts those of all devices
  StruckDevice(std::unique_ptr<Backend> inner, pid_t process, int& batches, Strike strike)
      : ForwardingBackend(std::move(inner)), process_(process), batches_(batches), strike_(std::move(strike)) {
    info_.timers = {Timer::fenced_wall};
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    if (std::ranges::find(strike_.at, batches_++) != strike_.at.end()) {
      if (strike_.signal == kLost) fail_device(Fault::device_lost, "lost");
      kill(process_, strike_.signal);
    }
    return ForwardingBackend::render(frame, frames, timer);
  }

 private:
  pid_t process_;
  int& batches_;
  Strike strike_;
};

/// Runs on devices in workers, of which a test lets some fail.
class Isolation : public ::testing::Test {
 protected:
  /// A real driver compiles within its first batch, which on a loaded machine takes a second.
  [[nodiscard]] Config config(const std::string& sweeps, int timeout_s = 1) const {
    std::ofstream(folder_ / "config.json") << R"({
      "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
      "measure": {"samples": 2, "batch_ms": 0.1, "warmup_batches_max": 1, "block_cases": 3, "flicker_frames": 0,
                  "timeout_s": )" << timeout_s
                                           << R"(}, "sweeps": [)" << sweeps << "]}";
    return load_config(folder_ / "config.json");
  }
  SweepSummary sweep(const Config& config, const std::string& name, const std::string& backend,
                     const OpenDevice& open) const {
    return run_sweep(
        config,
        {.output = folder_ / name, .backends = {backend}, .pictures = Pictured::none, .quiet = true, .open = open});
  }
  [[nodiscard]] std::map<std::string, Record> records(const std::string& name) const {
    std::map<std::string, Record> all;
    for (const Record& record : load_run(folder_ / name).records) all.insert_or_assign(record.case_id, record);
    return all;
  }
  [[nodiscard]] StatusByTechnique statuses(const std::string& name) const {
    StatusByTechnique all;
    for (const auto& [id, record] : records(name)) all[record.technique] = status_id(record.status);
    return all;
  }
  [[nodiscard]] std::string reason(const std::string& name, const std::string& technique) const {
    for (const auto& [id, record] : records(name))
      if (record.technique == technique) return record.reason;
    return "no such case";
  }
  /// Devices in workers; those that draw the batches of these numbers, from 0, get the signal.
  [[nodiscard]] OpenDevice struck(std::vector<int> at, int signal) {
    batches_ = 0;
    return [this, at = std::move(at), signal](const BackendRow& row, int) {
      auto worker = start_worker();
      const pid_t process = worker->process();
      return std::make_unique<StruckDevice>(open_remote(std::move(worker), row, 0, {}), process, batches_,
                                            Strike{.at = at, .signal = signal});
    };
  }
  [[nodiscard]] OpenDevice healthy() { return struck({}, 0); }
  /// Errors are the same to the bit; software's times are not.
  void expect_same_errors(const std::string& name, const std::string& whole) const {
    const auto expected = records(whole);
    for (const auto& [id, record] : records(name)) {
      if (record.status != Status::ok) continue;
      for (const MetricRow& row : metrics())
        EXPECT_EQ(row.value(*record.error), row.value(*expected.at(id).error)) << id << ' ' << row.place;
    }
  }

  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
  int batches_ = 0;

 private:
  const GivenVariables none_{{}};  // but that a process dies at once that is shot, without ASan's long last words
};

}  // namespace reliefbench
