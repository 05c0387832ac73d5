// Shards of a sweep on the null backend, which makes up the same numbers in every run, joined into one.
#include "tuner/measure/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include "kernels/base/error.h"
#include "tests/cli_rig.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/written_run.h"
#include "tuner/decide/compare.h"
#include "tuner/history/ingest.h"
#include "tuner/measure/sweep.h"
#include "tuner/results/case_table.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

/// The smoke config's run, and its three shards: swept once for all tests.
class MergeTest : public CliTest {
 protected:
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "reliefbench_MergeTest_XXXXXX").string();
    swept_ = ::mkdtemp(name.data());
    const OwnCache cache(swept_ / "cache");
    sweep(swept_ / "whole", std::nullopt);
    for (int index = 1; index <= 3; ++index) sweep(swept_ / shard_name(index), Shard{.index = index, .of = 3});
  }
  static void TearDownTestSuite() { fs::remove_all(swept_); }

  static std::string shard_name(int index) { return "shard_" + std::to_string(index); }
  static void sweep(const fs::path& folder, std::optional<Shard> shard) {
    static_cast<void>(
        run_sweep(load_config(kSmoke), {.output = folder, .backends = {"null"}, .shard = shard, .quiet = true}));
  }
  /// A copy of a swept run, with something changed in it.
  fs::path changed(const std::string& name, const std::string& as,
                   const std::function<void(reliefbench::Run&)>& change) {
    fs::copy(swept_ / name, folder_ / as, fs::copy_options::recursive);
    reliefbench::Run run = load_run(folder_ / as);
    change(run);
    write_run(run);
    return folder_ / as;
  }
  /// As a machine that takes so many times as long has it.
  fs::path slowed(const std::string& name, const std::string& as, double by) {
    return changed(name, as, [by](reliefbench::Run& run) {
      for (Sample& sample : run.samples) sample.frame_time_ns *= by;
      for (Record& record : run.records)
        for (double* time :
             {&record.frame_time->summary.median, &record.frame_time->summary.mad, &record.frame_time->summary.ci_low,
              &record.frame_time->summary.ci_high, &record.frame_time->raw_median})
          *time *= by;
      json& device = run.info["devices"][0];
      device["control_reference_ns"] = by * device["control_reference_ns"].get<double>();
      run.info["host"]["name"] = "slow";
    });
  }
  [[nodiscard]] static std::vector<fs::path> shards() { return {shard(1), shard(2), shard(3)}; }
  [[nodiscard]] static fs::path shard(int index) { return swept_ / shard_name(index); }
  [[nodiscard]] JoinedRuns merge(const std::vector<fs::path>& folders, const std::string& name = "merged") const {
    return merge_runs(folders, folder_ / name);
  }
  /// In one line that names both, and nothing is left.
  void expect_no_merge(const std::vector<fs::path>& folders, const std::string& words) const {
    EXPECT_THAT([&] { (void)merge(folders, "refused"); },
                ThrowsMessage<Error>(AllOf(HasSubstr(words), Not(HasSubstr("\n")))))
        << words;
    EXPECT_FALSE(fs::exists(folder_ / "refused"));
  }

  static inline fs::path swept_;
};

std::map<std::string, Record> by_id(const fs::path& folder) {
  std::map<std::string, Record> records;
  for (const Record& record : load_run(folder).records)
    EXPECT_TRUE(records.emplace(record.case_id, record).second) << record.case_id << " stands twice";
  return records;
}

/// The same cases with the same errors, keys and statuses.
void expect_same_findings(const fs::path& merged, const fs::path& whole) {
  const auto ours = by_id(merged);
  const auto theirs = by_id(whole);
  ASSERT_EQ(ours.size(), theirs.size());
  for (const auto& [id, record] : ours) {
    const auto other = theirs.find(id);
    ASSERT_NE(other, theirs.end()) << id;
    EXPECT_EQ(record.error, other->second.error) << id;
    EXPECT_EQ(record.status, other->second.status) << id;
    EXPECT_EQ(record.scene_key, other->second.scene_key) << id;
    EXPECT_EQ(record.timing_key, other->second.timing_key) << id;
    EXPECT_EQ(record.bake_key, other->second.bake_key) << id;
    EXPECT_EQ(record.memory_bytes, other->second.memory_bytes) << id;
  }
}

TEST_F(MergeTest, is_the_undivided_run_however_many_shards) {
  for (const int of : {1, 3, 7}) {
    std::vector<fs::path> folders;
    for (int index = 1; index <= of; ++index) {
      folders.push_back(of == 3 ? shard(index) : folder_ / (std::to_string(index) + "of" + std::to_string(of)));
      if (of != 3) sweep(folders.back(), Shard{.index = index, .of = of});
    }
    const std::string name = "merged" + std::to_string(of);
    const JoinedRuns joined = merge(folders, name);
    EXPECT_EQ(joined.missing, "");
    EXPECT_EQ(joined.held_twice, 0U);
    EXPECT_EQ(joined.run.info.at("parts").size(), static_cast<std::size_t>(of));
    expect_same_findings(folder_ / name, swept_ / "whole");
  }
}

TEST_F(MergeTest, leaves_all_files_of_a_run) {
  (void)merge(shards());
  const auto names = [](const fs::path& folder) {
    std::set<std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) all.insert(fs::relative(entry.path(), folder));
    return all;
  };
  const std::set<std::string> merged = names(folder_ / "merged");
  for (const std::string& name : names(swept_ / "whole")) EXPECT_TRUE(merged.contains(name)) << name;
  for (const std::string& name : merged) EXPECT_FALSE(name.starts_with(".")) << name;
  std::ifstream in((folder_ / "merged") / kRunFile);
  const json info = json::parse(in);
  EXPECT_EQ(schema_errors(info, "run"), "");
  EXPECT_TRUE(info.at("finished").is_string());
  EXPECT_EQ(info.at("counts").at("cases"), load_run(swept_ / "whole").records.size());
  std::set<int> parts;
  std::ifstream samples((folder_ / "merged") / kSamplesFile);
  for (std::string line; std::getline(samples, line);) {
    EXPECT_EQ(schema_errors(json::parse(line), "samples"), "") << line;
    parts.insert(json::parse(line).value("part", 0));
  }
  EXPECT_EQ(parts, (std::set{0, 1, 2}));
}

// A case's time goes by its own machine's control case, so that one of half the speed changes nothing.
TEST_F(MergeTest, times_go_by_the_own_machines_control_case) {
  const fs::path slow = slowed("shard_2", "slow", 2);
  const JoinedRuns joined = merge({shard(1), slow, shard(3)});
  EXPECT_NEAR(joined.greatest_control / joined.least_control, 2, 0.2);
  (void)merge(shards(), "even");
  const auto even = by_id(folder_ / "even");
  for (const auto& [id, record] : by_id(folder_ / "merged"))
    EXPECT_NEAR(record.frame_time->summary.median / even.at(id).frame_time->summary.median, 1, 1e-12) << id;

  // What the record says is what the samples say.
  const reliefbench::Run run = load_run(folder_ / "merged");
  const SamplesByCase samples = group_samples(run.samples);
  const double reference_ns = run.info["devices"][0]["control_reference_ns"];
  for (const Record& record : run.records) {
    const FrameTime again =
        frame_time(samples.at(record.case_id), samples.at(control_case_id("null")), reference_ns, "fenced_wall");
    EXPECT_NEAR(again.summary.median / record.frame_time->summary.median, 1, 1e-12) << record.case_id;
    EXPECT_NEAR(again.summary.ci_high / record.frame_time->summary.ci_high, 1, 1e-12) << record.case_id;
  }
}

// Who drew which shard moves neither a case nor the control case.
TEST_F(MergeTest, machines_may_take_other_shards) {
  (void)merge({slowed("shard_1", "slow_1", 1.5), shard(2), shard(3)}, "before");
  (void)merge({slowed("shard_3", "slow_3", 1.5), shard(1), slowed("shard_2", "slow_2", 1.5)}, "after");
  const Comparison comparison = compare_runs(load_run(folder_ / "before"), load_run(folder_ / "after"), {});
  ASSERT_EQ(comparison.control_ratio.size(), 1U);
  EXPECT_NEAR(comparison.control_ratio.front().second, 1, 0.05);
  for (const CaseChange& one : comparison.cases) EXPECT_NE(one.reason, Reason::control_drift) << one.case_id;
  const auto control_ns = [&](const char* name) {
    return read_night(folder_ / name, {}).run.calibrations.at(0).control_ns;
  };
  EXPECT_NEAR(control_ns("after") / control_ns("before"), 1, 0.05);
}

TEST_F(MergeTest, other_commands_take_it_for_a_run) {
  ASSERT_EQ(run({"merge", shard(1), shard(2), shard(3), "-o", "merged"}).exit_code, 0);
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"report", "merged"},
           {"recommend", "merged", "--max-error", "missed_rate<=1", "--json"},
           {"presets", "merged", "-o", "presets.json", "--constraint", "missed_rate<=1"},
           {"track", "ingest", "merged", swept_ / "whole", "--db", "nights.sqlite"},
           {"compare", swept_ / "whole", "merged", "--json"}}) {
    const CommandResult result = run(command);
    EXPECT_TRUE(result.exit_code == 0 || (command.front() == "compare" && result.exit_code == 4))
        << command.front() << ": " << result.exit_code << " " << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("samples"))) << command.front();
  }
  expect_refused({"sweep", kSmoke, "--backend", "null", "-o", "merged"}, 2, "holds another run: its 'merged' is");
}

TEST_F(MergeTest, a_merged_run_is_merged_again) {
  (void)merge({shard(1), shard(2)}, "two");
  const JoinedRuns joined = merge({folder_ / "two", shard(3)});
  EXPECT_EQ(joined.missing, "");
  EXPECT_EQ(joined.run.info.at("parts").size(), 3U);
  expect_same_findings(folder_ / "merged", swept_ / "whole");
  // What adds nothing leaves nothing.
  const JoinedRuns again = merge({folder_ / "merged", shard(2)}, "again");
  EXPECT_EQ(again.left_out, (std::vector<std::string>{shard(2).string()}));
  EXPECT_EQ(again.run.info.at("parts").size(), 3U);
  EXPECT_EQ(again.held_twice, load_run(shard(2)).records.size());
  EXPECT_EQ(load_run(folder_ / "again").samples.size(), load_run(folder_ / "merged").samples.size());
}

TEST_F(MergeTest, in_another_order_or_from_another_place_it_is_the_same_run) {
  (void)merge(shards(), "one");
  std::vector<fs::path> moved;
  for (const int index : {3, 1, 2})
    fs::copy(shard(index), moved.emplace_back(folder_ / ("moved_" + std::to_string(index))),
             fs::copy_options::recursive);
  (void)merge(moved, "other");
  EXPECT_THAT(run({"track", "ingest", "one", "other", "--db", "nights.sqlite"}).out,
              HasSubstr("other: is there already"));
  EXPECT_EQ(load_run(folder_ / "one").info.at("identity"), load_run(folder_ / "other").info.at("identity"));
  (void)merge({moved[0], moved[1]}, "two");
  (void)merge({folder_ / "two", shard(2)}, "again");
  EXPECT_EQ(load_run(folder_ / "one").info.at("identity"), load_run(folder_ / "again").info.at("identity"));
}

// A merged run's samples are those of its parts, by another clock and beside others' control samples.
TEST_F(MergeTest, what_it_holds_is_compared_as_the_same_measurement) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.02);
  std::vector<fs::path> noisy;
  for (int index = 1; index <= 3; ++index)
    noisy.push_back(changed(shard_name(index), "noisy_" + std::to_string(index), [&](reliefbench::Run& run) {
      for (Sample& sample : run.samples) sample.frame_time_ns *= std::exp(noise(random));
    }));
  (void)merge({noisy[1], noisy[2]}, "two");
  (void)merge({folder_ / "two", noisy[0]}, "merged");
  (void)merge(noisy, "other");
  for (const fs::path& other : {noisy[0], noisy[2], folder_ / "two", folder_ / "other"}) {
    const CommandResult result = run({"compare", other, "merged", "--json"});
    EXPECT_EQ(result.exit_code, 0) << other << result.out.substr(0, 2000) << result.err;
    for (const json& one : json::parse(result.out).at("cases"))
      EXPECT_EQ(one.at("reason"), "same_measurement") << one.dump();
  }
}

TEST_F(MergeTest, shards_of_two_divisions_overlap) {
  sweep(folder_ / "half", Shard{.index = 1, .of = 2});
  const JoinedRuns joined = merge({folder_ / "half", shard(1), shard(2), shard(3)});
  EXPECT_EQ(joined.missing, "") << "the thirds are all there";
  EXPECT_EQ(joined.held_twice, load_run(folder_ / "half").records.size());
  expect_same_findings(folder_ / "merged", swept_ / "whole");
}

TEST_F(MergeTest, what_is_missing_is_said_and_the_run_unfinished) {
  const CommandResult result = run({"merge", shard(3), "-o", "merged"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "reliefbench: shards 1, 2 of 3 are missing\n");
  EXPECT_TRUE(load_run(folder_ / "merged").info.at("finished").is_null());
  EXPECT_THAT(run({"track", "ingest", "merged", "--db", "nights.sqlite"}).err,
              AllOf(HasSubstr("not finished; shard"), HasSubstr("merge them, too")));
  EXPECT_EQ(run({"recommend", "merged", "--max-error", "missed_rate<=1"}).exit_code, 0);

  // A results file that a full disk or a kill tore.
  const fs::path torn = changed("shard_2", "torn", [](reliefbench::Run&) {});
  fs::resize_file(torn / kResultsFile, fs::file_size(torn / kResultsFile) - 5);
  const std::size_t cases = load_run(shard(2)).records.size();
  EXPECT_EQ(merge({shard(1), torn, shard(3)}, "with_torn").missing,
            fmt::format("shard 2 of 3 is unfinished ({} of {} cases)", cases - 1, cases));
  spoil(torn / kResultsFile, "\"case\"", "case");
  expect_no_merge({shard(1), torn}, "results.jsonl:1: not JSON");
}

TEST_F(MergeTest, a_case_that_failed_in_one_run_counts_from_the_other) {
  const fs::path failed = changed("shard_1", "failed", [](reliefbench::Run& run) {
    run.records.front().status = Status::device_lost;
    run.records.front().frame_time.reset();
    run.records.front().error.reset();
  });
  (void)merge({failed, shard(1)}, "later");
  expect_same_findings(folder_ / "later", shard(1));
  (void)merge({shard(1), failed}, "earlier");
  expect_same_findings(folder_ / "earlier", shard(1));
}

TEST_F(MergeTest, what_is_not_one_run_is_refused) {
  const auto other = [&](const std::string& as, const std::function<void(reliefbench::Run&)>& change) {
    return changed("shard_2", as, change);
  };
  const auto identity = [](const std::string& key, const json& value) {
    return [=](reliefbench::Run& run) { run.info["identity"][key] = value; };
  };
  const std::string sha(64, '0');
  expect_no_merge({shard(1), other("kernels", identity("kernels_sha256", sha))}, "was measured with other kernels");
  expect_no_merge({shard(1), other("config", identity("config_sha256", sha))},
                  (folder_ / "config").string() + ": is of another config than " + shard(1).string());
  expect_no_merge({shard(1), other("slow", identity("injected_slowdown", {{"cone", 2}}))}, "injected slowdowns");
  expect_no_merge({shard(1), other("tune", identity("tune", json::object()))}, "tune: is of tune; merge joins runs");
  expect_no_merge({shard(1), other("begun", [](auto& run) { run.info.erase("started_unix_ns"); })}, "has not begun");
  expect_no_merge({shard(1), other("driver", [](auto& run) { run.info["identity"]["devices"][0]["driver"] = "2"; })},
                  "its null device has the driver '2', that of");
  expect_no_merge({shard(1), other("cpu",
                                   [](auto& run) {
                                     run.info["host"]["cpu"] = "another";
                                     run.info["devices"][0]["software"] = true;
                                   })},
                  "its null device draws on 'another', that of");
  const auto frame_of = [](int side) {
    return [=](reliefbench::Run& run) {
      MeasuredScene& scene = run.scenes.front();
      scene.spec.scene.width_px = side;
      scene.key = scene_key(scene.heights_sha256, scene.spec.scene);
      for (Record& record : run.records) record.scene_key = scene.key;
    };
  };
  expect_no_merge({shard(1), other("frame", frame_of(32))}, "' is not that of " + shard(1).string() + ": frame 64x64");
  expect_no_merge({shard(1), folder_ / "frame"}, "now 32x64; `sweep --frame-px` gives all shards one size");
  const auto heights = [](reliefbench::Run& run) {
    MeasuredScene& scene = run.scenes.front();
    scene.heights_sha256 = std::string(64, '1');
    scene.key = scene_key(scene.heights_sha256, scene.spec.scene);
    for (Record& record : run.records) record.scene_key = scene.key;
  };
  expect_no_merge({shard(1), other("heights", heights)}, "now 11111111");
  const auto worse = [](reliefbench::Run& run) { (*run.records.front().error)["e_xy.p99"] = 17; };
  expect_no_merge({shard(2), other("worse", worse)}, "its 'error/e_xy/p99' is 17.0, in " + shard(2).string());
  expect_no_merge({shard(1), shard(1)}, "stands twice");
  expect_no_merge({folder_ / "none"}, "is not a run folder");
  std::ofstream(folder_ / "mine") << "mine";
  EXPECT_THAT([&] { (void)merge({shard(1)}, "mine"); }, ThrowsMessage<Error>(HasSubstr("is no folder")));
  EXPECT_THAT([&] { (void)merge({shard(1)}, "config"); }, ThrowsMessage<Error>(HasSubstr("is not empty")));
}

TEST_F(MergeTest, a_history_takes_a_merged_run_or_its_parts) {
  (void)merge(shards());
  const std::string merged = (folder_ / "merged").string();
  const auto ingest = [&](const fs::path& run, const char* database) {
    return run_reliefbench({"track", "ingest", run.string(), "--db", database}, folder_.path());
  };
  EXPECT_EQ(ingest(shard(2), "parts.sqlite").exit_code, 0);
  const CommandResult refused = ingest(merged, "parts.sqlite");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(refused.err, "reliefbench: " + merged +
                             ": run 1 of parts.sqlite was measured with it, in part or whole; "
                             "import a merged run or its parts, not both\n");
  EXPECT_EQ(ingest(shard(1), "parts.sqlite").exit_code, 0) << "another part is another measurement";

  EXPECT_EQ(ingest(merged, "merged.sqlite").exit_code, 0);
  EXPECT_THAT(ingest(shard(3), "merged.sqlite").err, HasSubstr("run 1 of merged.sqlite was measured with it"));
  EXPECT_THAT(ingest(merged, "merged.sqlite").out, HasSubstr("is there already"));

  // Whoever went on with a part, it is that part; one that adds nothing to a merged run is none of it.
  const fs::path moved = changed("shard_1", "moved", [](auto& run) { run.info["host"]["name"] = "another"; });
  (void)merge({moved, shard(2), shard(3)}, "with_moved");
  EXPECT_THAT(ingest(folder_ / "with_moved", "parts.sqlite").err, HasSubstr("was measured with it"));
  const fs::path again = changed("whole", "whole_again", [](auto& run) {
    run.info["started_unix_ns"] = run.info["started_unix_ns"].template get<double>() + 1e9;
  });
  (void)merge({swept_ / "whole", again}, "twice");
  EXPECT_EQ(ingest(folder_ / "twice", "wholes.sqlite").exit_code, 0);
  EXPECT_EQ(ingest(again, "wholes.sqlite").exit_code, 0);
  EXPECT_EQ(ingest(swept_ / "whole", "wholes.sqlite").exit_code, 2);
}

TEST_F(MergeTest, two_devices_of_one_model_are_one) {
  const fs::path second = changed("shard_2", "second", [](reliefbench::Run& run) {
    run.info["identity"]["devices"][0]["index"] = 1;
    run.info["devices"][0]["index"] = 1;
    run.info["host"]["name"] = "another";
  });
  EXPECT_EQ(merge({shard(1), second, shard(3)}).missing, "");
}

}  // namespace
}  // namespace reliefbench
