// Runs whose drivers crash, hang, lose the device or run out of memory: the case gets its status, all others are
// measured, and the front is that of a run without the case.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <fstream>
#include <map>
#include <type_traits>

#include "tests/own_cache.h"
#include "tests/remote_device.h"
#include "tests/temp_folder.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/stress.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using StatusByTechnique = std::map<std::string, std::string>;  // by technique

constexpr int kLost = 0;  // in a signal's place: the driver says itself that the device is lost

/// A device in a worker, which gets a signal in some of its batches. It has one timer: each takes its time to audit.
class StruckDevice final : public Backend {
 public:
  StruckDevice(const BackendRow& row, int& batches, std::vector<int> at, int signal)
      : batches_(batches), at_(std::move(at)), signal_(signal) {
    auto worker = start_worker();
    process_ = worker->process();
    inner_ = open_remote(std::move(worker), row, 0, {});
    device_ = inner_->device();
    device_.timers = {Timer::fenced_wall};
  }
  const DeviceInfo& device() const override { return device_; }
  std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    return told([&] { return inner_->upload(desc); });
  }
  std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    return told([&] { return inner_->compile(desc); });
  }
  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
    if (std::ranges::find(at_, batches_++) != at_.end()) {
      if (signal_ == kLost) fail_device(Fault::device_lost, "lost");
      kill(process_, signal_);
    }
    inner_->set_render_limit(render_limit_s());
    return told([&] { return inner_->render(frame, frames, timer); });
  }
  std::span<const std::uint8_t> read(std::string_view attachment) override {
    return told([&] { return inner_->read(attachment); });
  }
  std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    return told([&] { return inner_->compile_compute(desc); });
  }
  ComputeResult compute(const ComputeJob& job) override {
    return told([&] { return inner_->compute(job); });
  }
  std::vector<std::string> debug_messages() const override { return inner_->debug_messages(); }

 private:
  /// What the inner device does; if it is gone then, so is this one.
  template <typename Work>
  std::invoke_result_t<Work> told(const Work& work) {
    try {
      return work();
    } catch (const Error&) {
      if (inner_->is_gone()) set_gone();
      throw;
    }
  }

  int& batches_;
  std::vector<int> at_;
  int signal_;
  pid_t process_ = 0;
  std::unique_ptr<Backend> inner_;
  DeviceInfo device_;
};

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
      return std::make_unique<StruckDevice>(row, batches_, at, signal);
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

class IsolationOfDrivers : public Isolation, public ::testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override {
    if (find_backend(GetParam()).devices().empty()) GTEST_SKIP() << "no device of " << GetParam();
    std::ofstream(folder_ / "faults.json")
        << R"({"file_format_version": "1.1.2", "layer": {"name": "VK_LAYER_RELIEFBENCH_faults", "type": "GLOBAL",
               "api_version": "1.2.0", "implementation_version": "1", "description": "fails",
               "library_path": ")"
        << RELIEFBENCH_DRIVER_FAULTS << R"("}})";
  }
  [[nodiscard]] Variables with(const std::string& faults) const {
    Variables variables{{"DRIVER_FAULTS", faults}, {"DRIVER_FAULT_COUNT", (folder_ / "count").string()}};
    if (GetParam() == "opengl") {
      variables["LD_PRELOAD"] = RELIEFBENCH_DRIVER_FAULTS;
    } else {
      variables["VK_INSTANCE_LAYERS"] = "VK_LAYER_RELIEFBENCH_faults";
      variables["VK_LAYER_PATH"] = folder_.path();
    }
    return variables;
  }
};

TEST_P(IsolationOfDrivers, every_way_to_fail_ends_its_case_alone) {
  const Config five = config(R"({"technique": "relief", "axes": {"linear_steps": [4, 16], "refinement": "none"}},
                                {"technique": "cone"}, {"technique": "distance"}, {"technique": "depth_slices"},
                                {"technique": "max_mip"})",
                             4);
  sweep(five, "whole", GetParam(), healthy());
  {
    const GivenVariables failing(
        with("crash after CONE_STEPS;hang after SPHERE_STEPS;lost after SLICES;memory after NODE_STEPS"));
    const SweepSummary summary = sweep(five, "run", GetParam(), healthy());
    EXPECT_EQ(summary.open, 3) << "the crash came twice";
  }
  EXPECT_EQ(statuses("run"), (StatusByTechnique{{"relief", "ok"},
                                                {"cone", "crashed"},
                                                {"distance", "timeout"},
                                                {"depth_slices", "device_lost"},
                                                {"max_mip", "out_of_memory"}}));
  EXPECT_THAT(reason("run", "cone"), AllOf(HasSubstr("the driver crashed: Aborted"), HasSubstr("test driver: crash")));
  EXPECT_THAT(reason("run", "distance"), AllOf(HasSubstr("did not end within 4 s"), HasSubstr("test driver: hang")));
  EXPECT_THAT(reason("run", "depth_slices"), HasSubstr("; its last words: test driver: lost in draw"));
  EXPECT_THAT(reason("run", "max_mip"), HasSubstr("test driver: memory in draw"));
  expect_same_errors("run", "whole");

  if (GetParam() == "opengl") return;  // what follows is the same for both

  // Without the faults what failed once is drawn again; what failed twice is not.
  sweep(five, "run", GetParam(), healthy());
  EXPECT_EQ(statuses("run"),
            (StatusByTechnique{
                {"relief", "ok"}, {"cone", "crashed"}, {"distance", "ok"}, {"depth_slices", "ok"}, {"max_mip", "ok"}}));
  expect_same_errors("run", "whole");
}

TEST_P(IsolationOfDrivers, a_driver_that_crashes_in_an_audit_is_told) {
  CommandSetting setting;
  setting.environment = with("crash at 1");
  const CommandResult result =
      run_reliefbench({"devices", "--audit", "--backend", GetParam()}, folder_.path(), setting);
  EXPECT_EQ(result.exit_code, static_cast<int>(Exit::environment)) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the driver crashed: Aborted"));
}

TEST_P(IsolationOfDrivers, a_driver_that_fails_under_a_picture_or_a_bake_is_told_in_a_line) {
  struct Row {
    const char* fault;
    const char* words;
  };
  const auto refused = [&](const std::vector<std::string>& arguments, const Row& row) {
    SCOPED_TRACE(fmt::format("{} {}", arguments.front(), row.fault));
    std::filesystem::remove(folder_ / "count");
    const CommandResult result = run_reliefbench(arguments, folder_.path(), {.environment = with(row.fault)});
    EXPECT_EQ(result.exit_code, static_cast<int>(Exit::environment)) << result.err;
    const std::string last = result.err.substr(result.err.rfind("reliefbench: ") + 1);
    EXPECT_THAT(last, HasSubstr(row.words));
    EXPECT_EQ(std::ranges::count(last, '\n'), 1);
  };
  const std::vector<std::string> view = {"view",      "fbm",   "--size", "16x16",    "--case",    "relief",
                                         "--size-px", "16,16", "--png",  "view.png", "--backend", GetParam()};
  std::vector<std::string> other = view;
  std::ranges::replace(other, std::string("relief"), std::string("depth_slices"));
  refused(view, {"crash after LINEAR_STEPS", "the driver crashed: Aborted"});
  refused(other, {"lost after SLICES", "; its last words: test driver: lost in draw"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "view.png"));
  const std::vector<std::string> bake = {"bake",     "fbm",      "--size",      "16x16", "--map", "conservative",
                                         "--device", GetParam(), "--timeout-s", "2",     "-o",    "map.ktx2"};
  refused(bake, {"crash at 1", "the driver crashed: Aborted"});
  refused(bake, {"hang at 1", "a band of the compute job did not end within 2 s"});
  refused(bake, {"memory at 1", "; its last words: test driver: memory in draw 1"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "map.ktx2"));
}

// An allocation, a wait: whichever call it is, it costs a case at most, and all others are those of a whole run.
TEST_P(IsolationOfDrivers, allocations_and_waits_fail_as_draws_do) {
  const Config three = config(R"({"technique": "relief", "axes": {"linear_steps": [4, 16], "refinement": "none"}},
                                 {"technique": "cone"})",
                              4);
  std::array<int, 3> calls{};  // draws, allocations, waits of a whole run
  {
    const GivenVariables none(with(""));
    sweep(three, "whole", GetParam(), healthy());
    std::ifstream(folder_ / "count", std::ios::binary).read(reinterpret_cast<char*>(calls.data()), sizeof(calls));
  }
  struct Row {
    const char* what;
    const char* call;
    int all;
    Status status;
  };
  int failed = 0;
  for (const Row& row :
       {Row{"memory", "memory", calls[1], Status::out_of_memory}, Row{"lost", "wait", calls[2], Status::device_lost},
        Row{"hang", "wait", calls[2], Status::timeout}}) {
    ASSERT_GT(row.all, 3) << row.call;
    for (const int back : {1, row.all / 4}) {
      if (row.status == Status::timeout && back > 1) continue;  // an upload's end is awaited for a minute
      const std::string name = fmt::format("{}_{}", row.what, back);
      SCOPED_TRACE(name);
      std::filesystem::remove(folder_ / "count");
      const GivenVariables failing(with(fmt::format("{} at {} of {}", row.what, row.all - back, row.call)));
      sweep(three, name, GetParam(), healthy());
      int here = 0;
      for (const auto& [id, record] : records(name)) {
        if (record.status == Status::ok) continue;
        EXPECT_EQ(record.status, row.status) << record.reason;
        EXPECT_THAT(record.reason, HasSubstr(fmt::format("test driver: {} in {}", row.what, row.call)));
        ++here;
      }
      EXPECT_LE(here, 1);
      EXPECT_EQ(records(name).size(), 3U);
      expect_same_errors(name, "whole");
      failed += here;
    }
  }
  EXPECT_GT(failed, 0);
}

// A crash before the first case, in the audits or the calibration, is no case's fault.
TEST_P(IsolationOfDrivers, a_driver_that_crashes_once_before_the_cases_is_asked_again) {
  const Config two = config(R"({"technique": "relief", "axes": {"linear_steps": [4, 16], "refinement": "none"}})", 4);
  for (const int draw : {1, 30}) {
    std::filesystem::remove(folder_ / "count");
    const GivenVariables failing(with(fmt::format("crash at {}", draw)));
    EXPECT_EQ(sweep(two, fmt::format("at_{}", draw), GetParam(), healthy()).statuses.at("ok"), 2);
  }
}

INSTANTIATE_TEST_SUITE_P(backends, IsolationOfDrivers, ::testing::Values("opengl", "vulkan"),
                         [](const auto& param) { return param.param; });

class IsolationOfNull : public Isolation {
 protected:
  /// The cases on the front, without those.
  [[nodiscard]] std::vector<std::string> front(const std::string& name, const std::string& without) const {
    std::vector<Record> kept;
    for (auto& [id, record] : records(name))
      if (record.status == Status::ok && id != without) kept.push_back(record);
    std::vector<std::string> ids;
    for (const Front& front : fronts(kept, "e_xy.p99", {}))
      for (const FrontPoint& point : front.points) ids.push_back(point.record->case_id);
    return ids;
  }
};

// The null device's times and errors are the same in every run, so that fronts are.
TEST_F(IsolationOfNull, the_front_is_that_of_a_run_without_the_case) {
  const Config eight = config(
      R"({"technique": "relief", "axes": {"linear_steps": [4, 8, 16, 32], "refinement": "none"}},
         {"technique": "cone", "axes": {"cone_steps": [4, 8, 16, 32]}})");
  sweep(eight, "whole", "null", healthy());
  const int all = batches_;
  std::map<std::string, int> seen;
  for (const auto& [signal, status] :
       {std::pair{SIGSEGV, Status::crashed}, std::pair{SIGSTOP, Status::timeout},
        std::pair{SIGKILL, Status::out_of_memory}, std::pair{kLost, Status::device_lost}})
    for (const int back : {3, 25, 50}) {
      const std::string name = fmt::format("{}_{}", status_id(status), back);
      SCOPED_TRACE(name);
      sweep(eight, name, "null", struck({all - back}, signal));
      std::string failed;
      for (const auto& [id, record] : records(name)) {
        if (record.status == Status::ok) continue;
        EXPECT_EQ(record.status, status) << id << ": " << record.reason;
        EXPECT_EQ(failed, "") << "one case alone";
        failed = id;
        ++seen[std::string(status_id(status))];
      }
      EXPECT_EQ(records(name).size(), 8U);
      EXPECT_EQ(front(name, ""), front("whole", failed));
      expect_same_errors(name, "whole");
    }
  EXPECT_GT(seen["timeout"], 0);
  EXPECT_GT(seen["out_of_memory"], 0);
  EXPECT_GT(seen["device_lost"], 0);
  // One crash may be no fault of the case: it was drawn again, and that went well.
  EXPECT_EQ(seen["crashed"], 0);

  // It is drawn again last: there it crashes once more.
  int crashed = 0;
  for (const int back : {25, 50}) {
    sweep(eight, fmt::format("once_{}", back), "null", struck({all - back}, SIGSEGV));
    const int with_redrawn = batches_;
    for (const int end : {2, 3}) {
      const std::string name = fmt::format("twice_{}_{}", back, end);
      SCOPED_TRACE(name);
      sweep(eight, name, "null", struck({all - back, with_redrawn - end}, SIGSEGV));
      std::string failed;
      for (const auto& [id, record] : records(name))
        if (record.status == Status::crashed) {
          failed = id;
          ++crashed;
        }
      EXPECT_EQ(front(name, ""), front("whole", failed));
      expect_same_errors(name, "whole");
    }
  }
  EXPECT_GT(crashed, 0);
}

TEST_F(IsolationOfNull, tuning_leaves_a_setting_out_and_the_next_start_tries_it_again) {
  const Config eight = config(
      R"({"technique": "relief", "axes": {"linear_steps": [4, 8, 16, 32], "refinement": "none"}},
         {"technique": "cone", "axes": {"cone_steps": [4, 8, 16, 32]}})");
  const auto tuned = [&](const std::string& name, const OpenDevice& open) {
    TuneOptions options;
    options.output = folder_ / name;
    options.backend = "null";
    options.quiet = true;
    options.open = open;
    return run_tune(eight, options);
  };
  const TuneResult whole = tuned("whole", healthy());
  ASSERT_EQ(whole.counts.scored, 8);
  const int all = batches_;
  int left_out = 0;
  for (int at = all / 2; at < all; at += all / 12) {
    const std::string name = "at" + std::to_string(at);
    SCOPED_TRACE(name);
    const TuneResult first = tuned(name, struck({at}, SIGSEGV));
    EXPECT_EQ(first.counts.scored + first.counts.failed, 8);
    EXPECT_LE(first.counts.failed, 1);  // none in a batch of the control case
    left_out += first.counts.failed;
    const TuneResult second = tuned(name, healthy());
    EXPECT_EQ(second.counts.scored, 8);
    EXPECT_EQ(second.search.answers.size(), whole.search.answers.size());
  }
  EXPECT_GT(left_out, 0);
}

TEST_F(IsolationOfNull, stress_tells_what_the_driver_was_lost_over) {
  Extremes extremes = built_in_extremes();
  extremes.list.erase(extremes.list.begin() + 2, extremes.list.end());
  const auto stressed = [&](const OpenDevice& open) {
    return run_stress(extremes, {.backends = {"null"}, .filter = "flat/*", .quiet = true, .open = open});
  };
  const StressReport whole = stressed(healthy());
  const int all = batches_;
  const StressReport report = stressed(struck({all / 2}, SIGSEGV));
  ASSERT_EQ(report.results.size(), whole.results.size());
  int lost = 0;
  for (std::size_t i = 0; i < whole.results.size(); ++i) {
    const StressResult& result = report.results[i];
    lost += result.is_lost ? 1 : 0;
    if (result.is_lost) {
      EXPECT_FALSE(result.holds());
      EXPECT_THAT(result.skipped, HasSubstr("the driver crashed"));
    } else {
      EXPECT_EQ(result.faults, whole.results[i].faults);
      EXPECT_EQ(result.e_xy_p99, whole.results[i].e_xy_p99);
    }
  }
  EXPECT_EQ(lost, 1);
}

}  // namespace
}  // namespace reliefbench
