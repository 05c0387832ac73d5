// Run folders and Google Benchmark's files as nights.
#include "tuner/history/ingest.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "tests/finished_run.h"
#include "tests/history_rig.h"
#include "tests/written_run.h"
#include "tuner/history/google_benchmark.h"
#include "tuner/history/moment.h"
#include "tuner/history/standard_error.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

std::string night_error(const std::filesystem::path& path, const NightLabels& labels = {}) {
  try {
    static_cast<void>(read_night(path, labels));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

const Night::Value& value_of(const Night& night, const std::string& setting, const std::string& metric) {
  const auto found = std::ranges::find_if(night.values, [&](const Night::Value& value) {
    return value.series.setting == setting && value.series.metric == metric;
  });
  if (found == night.values.end()) throw std::runtime_error(setting + " " + metric + ": no such value");
  return *found;
}

class IngestRunTest : public ::testing::Test {
 protected:
  IngestRunTest() : run_(sampled_run({.folder = folder_ / "run", .cases = 5})) { write_run(run_); }

  TempFolder folder_;
  reliefbench::Run run_;
};

TEST_F(IngestRunTest, a_run_is_a_night) {
  const Night night = read_night(run_.folder, {});
  EXPECT_EQ(night.run.kind, "reliefbench");
  EXPECT_EQ(night.run.unix_s, 1'795'348'800);
  EXPECT_EQ(night.run.build.commit, "15450c1");
  EXPECT_FALSE(night.run.machine.empty()) << "this host's, where run.json is too old to know its own";
  EXPECT_EQ(night.values.size(), run_.records.size());
  EXPECT_TRUE(night.skipped.empty());
  ASSERT_EQ(night.run.calibrations.size(), 2U);
  EXPECT_EQ(night.run.calibrations.front().device, "opengl Synthetic GPU");
  EXPECT_GT(night.run.calibrations.front().control_ns, 812345);
  EXPECT_EQ(night.environment["devices"].size(), 2U);
  EXPECT_EQ(night.environment["host"]["memory_gib"], 7);
  EXPECT_EQ(night.run.health["devices"][0]["audit"].size(), 2U);
}

TEST_F(IngestRunTest, a_value_is_relative_to_the_control_case) {
  const Night night = read_night(run_.folder, {});
  for (std::size_t i = 0; i < run_.records.size(); ++i) {
    const Record& record = run_.records[i];
    const RepetitionRow& row = night.values[i].row;
    const SeriesRow& series = night.values[i].series;
    EXPECT_EQ(series.setting, match_key(record));
    EXPECT_EQ(series.case_id, record.case_id);
    EXPECT_EQ(row.status, status_id(record.status));
    EXPECT_EQ(row.is_valid, record.status == Status::ok);
    EXPECT_EQ(night.values[i].score.has_value(), record.error.has_value());
    if (record.status != Status::ok) {
      EXPECT_EQ(row.n, 0);
      continue;
    }
    EXPECT_EQ(row.n, 3);
    EXPECT_EQ(row.samples.size(), 3U);
    // The device slows down by the second, and the control case with it: their ratio does not show it.
    EXPECT_NEAR(row.value / (record.frame_time->summary.median / 812345), 1, 0.02);
    EXPECT_GT(row.standard_error, 0);
    EXPECT_LT(row.standard_error, 0.05);
    const json score = json::parse(*night.values[i].score);
    EXPECT_EQ(score["memory_bytes"], record.memory_bytes);
    EXPECT_EQ(score["e_xy.p99"], record.error->at("e_xy.p99"));
    EXPECT_EQ(score["psnr"].is_null(), !(*record.error)["psnr"].has_value()) << "pictures that are the same";
    EXPECT_EQ(score.contains("flip"), (*record.error)["flip"].has_value()) << "what nobody measured";
  }
}

TEST_F(IngestRunTest, labels_win_over_what_the_files_say) {
  const Night night = read_night(run_.folder, {.commit = "abc-dirty", .parent = "def", .unix_s = 5, .machine = "farm"});
  EXPECT_EQ(night.run.build.commit, "abc");
  EXPECT_TRUE(night.run.build.is_dirty);
  EXPECT_EQ(night.run.build.parent, "def");
  EXPECT_EQ(night.run.unix_s, 5);
  EXPECT_EQ(night.run.machine, "farm");
  EXPECT_EQ(night.values.front().series.machine, "farm");
  EXPECT_EQ(night.run.content, read_night(run_.folder, {}).run.content) << "labels make no other night";
}

TEST_F(IngestRunTest, a_timer_that_is_not_believed_and_a_missing_control_make_no_valid_value) {
  run_.info["devices"][0]["audit"][0]["valid"] = false;
  std::erase_if(run_.samples, [](const Sample& sample) { return sample.case_id == "control@vulkan"; });
  write_run(run_);
  const Night night = read_night(run_.folder, {});
  EXPECT_EQ(night.run.calibrations.size(), 1U);
  for (const Night::Value& value : night.values) EXPECT_FALSE(value.row.is_valid) << value.series.case_id;
}

TEST_F(IngestRunTest, what_is_left_out_is_told) {
  std::erase_if(run_.samples, [&](const Sample& sample) { return sample.case_id == run_.records[0].case_id; });
  Record same = run_.records[1];  // the same scene by another name
  same.scene = "copy/oblique";
  same.case_id.replace(same.case_id.find('@') + 1, std::string("rocks/oblique").size(), same.scene);
  run_.records.push_back(same);
  write_run(run_);
  const Night night = read_night(run_.folder, {});
  ASSERT_EQ(night.skipped.size(), 2U);
  EXPECT_THAT(night.skipped[0], HasSubstr("has no samples"));
  EXPECT_THAT(night.skipped[1], HasSubstr("the same setting and scene"));
  const std::string database = (folder_ / "h.db").string();
  EXPECT_EQ(History(database, History::Access::write).add(night), 1);
}

TEST_F(IngestRunTest, a_run_that_was_gone_on_with_keeps_its_origin) {
  const Night before = read_night(run_.folder, {});
  run_.samples.push_back(
      {.case_id = run_.records[0].case_id, .round = 3, .frames = 3, .frame_time_ns = 5, .at_ns = 9e9});
  write_run(run_);
  const Night after = read_night(run_.folder, {});
  EXPECT_EQ(after.origin, before.origin);
  EXPECT_NE(after.run.content, before.run.content);
}

TEST_F(IngestRunTest, a_run_of_no_year_of_four_digits_is_refused) {
  for (const double started_ns : {-1.0, 253402300800e9, 1.8e81}) {  // the last one was found by the fuzzer
    run_.info["started_unix_ns"] = started_ns;
    write_run(run_);
    EXPECT_THAT(night_error(run_.folder),
                HasSubstr("run.json: key 'started_unix_ns': expected nanoseconds since 1970"));
  }
}

TEST(Clock, moments_are_in_years_of_four_digits) {
  EXPECT_EQ(utc_text(1.7e18), "2023-11-14T22:13:20Z");
  EXPECT_EQ(utc_text(1e300), "9999-12-31T23:59:59Z");
  EXPECT_EQ(utc_text(-1e300), "0001-01-01T00:00:00Z");
}

TEST_F(IngestRunTest, what_is_no_finished_run_is_refused) {
  run_.info["finished"] = nullptr;
  write_run(run_);
  EXPECT_THAT(night_error(run_.folder), HasSubstr("run.json: key 'finished': the run is not finished"));
  EXPECT_THAT(night_error(folder_.path()), HasSubstr("is no run of sweep or tune: it has no run.json"));
  EXPECT_THAT(night_error(folder_ / "none"), HasSubstr("none"));
  std::ofstream(folder_ / "stress.json") << R"({"cases": []})";
  EXPECT_THAT(night_error(folder_ / "stress.json"), HasSubstr("expected a run's folder, or Google Benchmark's JSON"));
}

class GoogleBenchmarkTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file(const std::string& benchmarks, const std::string& context = "") const {
    std::ofstream(folder_ / "b.json") << fmt::format(
        R"({{"context": {{"date": "2026-11-22T13:00:00+01:00", "host_name": "farm", "num_cpus": 2, "mhz_per_cpu": 2899,
            "load_avg": [1,2,3]{}}}, "benchmarks": [{}]}})",
        context, benchmarks);
    return folder_ / "b.json";
  }
  TempFolder folder_;
};

TEST_F(GoogleBenchmarkTest, its_own_file_of_version_1_7) {
  const Night night = read_night(std::string(RELIEFBENCH_SOURCE_DIR) + "/tests/data/google_benchmark_1.7.json", {});
  EXPECT_EQ(night.run.kind, "google-benchmark");
  EXPECT_FALSE(night.run.machine.empty());
  EXPECT_FALSE(night.environment.contains("load_avg"));
  const Night::Value& real = value_of(night, "BM_sort/1024", "real_time");
  EXPECT_EQ(real.row.n, 3) << "repetitions, not their aggregates";
  EXPECT_TRUE(real.row.is_valid);
  EXPECT_EQ(real.series.unit, "ns");
  EXPECT_EQ(real.series.technique, "BM_sort");
  EXPECT_FALSE(value_of(night, "BM_sort/1024", "items_per_second").series.lower_is_better);
  EXPECT_TRUE(value_of(night, "BM_sort/1024", "spills").series.lower_is_better);
  const Night::Value& failed = value_of(night, "BM_fails", "real_time");
  EXPECT_FALSE(failed.row.is_valid);
  EXPECT_EQ(failed.row.status, "error");
  const Night::Value& nan = value_of(night, "BM_odd", "ratio");
  EXPECT_FALSE(nan.row.is_valid);
  EXPECT_EQ(nan.row.status, "not_finite");
  EXPECT_TRUE(value_of(night, "BM_odd", "real_time").row.is_valid);
}

TEST_F(GoogleBenchmarkTest, skipped_as_of_1_8_and_unknown_fields_of_1_9) {
  const Night night =
      read_night(file(R"({"name": "a", "run_name": "a", "run_type": "iteration", "skipped": true, "skip_message": "no",
               "real_time": 1, "cpu_time": 1, "time_unit": "ns"},
              {"name": "b/2", "run_name": "b/2", "run_type": "iteration", "real_time": 2.5, "cpu_time": 1,
               "time_unit": "us", "label": "x", "news": {"deep": [1]}, "threads": 4, "inf_count": -Infinity})",
                      R"(, "json_schema_version": 1, "later": [NaN])"),
                 {});
  EXPECT_EQ(value_of(night, "a", "real_time").row.status, "skipped");
  EXPECT_FALSE(value_of(night, "a", "real_time").row.is_valid);
  EXPECT_EQ(value_of(night, "b/2", "real_time").row.value, 2500) << "in ns";
  EXPECT_EQ(value_of(night, "b/2", "real_time").row.standard_error, 0) << "of one value";
  EXPECT_FALSE(value_of(night, "b/2", "inf_count").row.is_valid);
  EXPECT_EQ(night.values.size(), 5U);
  EXPECT_EQ(night.run.unix_s, 1'795'348'800);
  EXPECT_EQ(night.environment["mhz_per_cpu"], 2900);
  EXPECT_FALSE(night.environment.contains("later"));
}

TEST_F(GoogleBenchmarkTest, a_clock_that_no_processor_has_is_left_out) {
  for (const char* mhz : {"2.4e113", "-1e30", "9223372036854775808"}) {
    std::ofstream(folder_ / "b.json") << fmt::format(
        R"({{"context": {{"date": "2026-11-22T13:00:00+01:00", "mhz_per_cpu": {}}}, "benchmarks": [
            {{"name": "a", "run_name": "a", "run_type": "iteration", "real_time": 1, "time_unit": "ns"}}]}})",
        mhz);
    EXPECT_FALSE(read_night(folder_ / "b.json", {}).environment.contains("mhz_per_cpu")) << mhz;
  }
}

TEST_F(GoogleBenchmarkTest, aggregates_alone) {
  std::string entries;
  for (const auto& [name, time] : std::map<std::string, double>{{"mean", 11}, {"median", 10}, {"stddev", 2}})
    entries += fmt::format(R"({{"name": "a_{0}", "run_name": "a", "run_type": "aggregate", "aggregate_name": "{0}",
        "repetitions": 9, "real_time": {1}, "cpu_time": {1}, "time_unit": "ms", "aggregate_unit": "time"}},)",
                           name, time);
  const Night night =
      read_night(file(entries + R"({"name": "a_cv", "run_name": "a", "run_type": "aggregate", "aggregate_name": "cv",
          "repetitions": 9, "real_time": 0.2, "cpu_time": 0.2, "time_unit": "ms", "aggregate_unit": "percentage"},
         {"name": "a_BigO", "run_name": "a", "run_type": "aggregate", "aggregate_name": "BigO", "cpu_coefficient": 1,
          "real_coefficient": 2, "big_o": "N", "time_unit": "ns"})"),
                 {});
  ASSERT_EQ(night.values.size(), 2U);
  const RepetitionRow& row = value_of(night, "a", "real_time").row;
  EXPECT_EQ(row.median, 1e7);
  EXPECT_EQ(row.n, 9);
  EXPECT_TRUE(row.is_valid);
  EXPECT_TRUE(row.samples.empty());
  EXPECT_NEAR(row.standard_error, std::sqrt(M_PI / 2) * 0.2 / 3, 1e-4);
}

TEST_F(GoogleBenchmarkTest, a_time_that_is_none_is_asked_for) {
  EXPECT_THAT(night_error(file("", R"(, "date": 3)")), HasSubstr("key 'context.date'"));
  EXPECT_EQ(read_night(file("", R"(, "date": 3)"), {.unix_s = 7}).run.unix_s, 7);
}

TEST_F(GoogleBenchmarkTest, what_is_broken_is_told_with_its_line) {
  EXPECT_THAT(night_error(file("\n{\"name\": \"a\",\n oops}")), HasSubstr("b.json:4: not JSON"));
  EXPECT_THAT(night_error(file(R"({"name": "a", "real_time": 1e1097})")), HasSubstr("b.json: a number is too large"));
  EXPECT_THAT(night_error(file("{\"real_time\": 1}")), HasSubstr("key 'benchmarks[0]': has no name"));
  EXPECT_THAT(night_error(file(std::string(100, '['))), HasSubstr("over 64 levels deep"));
  std::ofstream(folder_ / "list.json") << "[1, 2]";
  EXPECT_THAT(night_error(folder_ / "list.json"), HasSubstr("expected a run's folder, or Google Benchmark's JSON"));
}

TEST(TolerantJson, leaves_strings_alone) {
  EXPECT_EQ(parse_tolerant_json(R"({"NaN \" inf": [NaN, -NaN, Infinity, -Infinity, nan, -inf, -1, "-NaN"]})", "f"),
            json::parse(R"({"NaN \" inf": [null, null, null, null, null, null, -1, "-NaN"]})"));
}

TEST(MomentTest, reads_iso_8601_and_unix_seconds) {
  EXPECT_EQ(parse_moment("2026-11-22T12:00:00Z", "t"), 1'795'348'800);
  EXPECT_EQ(parse_moment("2026-11-22T13:30:00.25+01:30", "t"), 1'795'348'800);
  EXPECT_EQ(parse_moment("2026-11-22T07:00-0500", "t"), 1'795'348'800);
  EXPECT_EQ(parse_moment("@-7", "t"), -7);
  for (const std::string bad : {"", "@", "@1x", "yesterday", "2026-11-22", "2026-02-30T00:00:00Z",
                                "2026-11-22T24:00:00Z", "2026-11-22T12:00:00"})
    EXPECT_THROW(static_cast<void>(parse_moment(bad, "t")), Error) << bad;
}

TEST(StandardErrorTest, is_that_of_a_normal_samples_median) {
  EXPECT_NEAR(log_median_error(100, 1 / 1.4826, 25), 1.2533 * 0.01 / 5, 1e-6);
  EXPECT_EQ(log_median_error(100, 1, 1), 0);
  // Three samples that happen to agree, among others that scatter.
  std::vector<RobustMedian> medians(50, {.median = 100, .mad = 1, .n = 3});
  medians.front().mad = 0;
  medians.push_back({.median = 100, .mad = 0, .n = 1});
  medians.push_back({});
  const std::vector<double> errors = moderated_errors(medians);
  EXPECT_GT(errors.front(), errors[1] / 4);
  EXPECT_EQ(errors[50], 0);
  EXPECT_EQ(errors[51], 0);
}

}  // namespace
}  // namespace reliefbench
