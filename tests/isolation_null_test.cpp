// Runs on the null device whose worker gets signals: what it costs a sweep, a tuning and a stress run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/isolation_rig.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/stress.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

class IsolationOfNull : public Isolation {
 protected:
  [[nodiscard]] Config eight_cases() const {
    return config(R"({"technique": "relief", "axes": {"linear_steps": [4, 8, 16, 32], "refinement": "none"}},
                     {"technique": "cone", "axes": {"cone_steps": [4, 8, 16, 32]}})");
  }
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
  const Config eight = eight_cases();
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
  const Config eight = eight_cases();
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
