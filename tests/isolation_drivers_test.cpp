// Runs whose drivers crash, hang, lose the device or run out of memory: the case gets its status, and all others are
// measured.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "tests/isolation_rig.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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

// Of the two test drivers the one of Vulkan keeps something; Mesa has no binaries of OpenGL's programs.
TEST_P(IsolationOfDrivers, who_keeps_pipelines_compiles_them_once) {
  const GivenVariables driver(with(""));
  const Config one = config(R"({"technique": "relief", "axes": {"linear_steps": [4, 16]}})", 4);
  const auto opener = [](bool keeps) {
    return [keeps](const BackendRow& row, int index) {
      return open_remote(start_worker(), row, index, {.keeps_pipelines = keeps});
    };
  };
  const auto count_timed = [&](const std::string& name) {
    return std::ranges::count_if(records(name), [](const auto& one) { return one.second.first_draw_ns.has_value(); });
  };
  const SweepSummary first = sweep(one, "first", GetParam(), opener(true));
  EXPECT_EQ(first.shaders_cached, 0);
  EXPECT_EQ(count_timed("first"), 2);
  const SweepSummary second = sweep(one, "second", GetParam(), opener(true));
  const bool keeps = GetParam() == "vulkan";
  EXPECT_EQ(second.shaders_cached, keeps ? first.shaders : 0);
  EXPECT_EQ(second.shaders, keeps ? 0 : first.shaders);
  EXPECT_EQ(count_timed("second"), keeps ? 0 : 2) << "what was not compiled has no time of it";
  expect_same_errors("second", "first");
  const SweepSummary anew = sweep(one, "anew", GetParam(), opener(false));
  EXPECT_EQ(anew.shaders_cached, 0);
  EXPECT_EQ(count_timed("anew"), 2);
}

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

}  // namespace
}  // namespace reliefbench
