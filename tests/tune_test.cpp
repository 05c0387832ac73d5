// Tuning as a whole: on the null backend, which measures in no time, and against the recorded sweep.
#include "tuner/tune/tune.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/faulty_device.h"
#include "tests/finished_run.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tests/thorough.h"
#include "tuner/measure/pictures.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/recorded_run.h"
#include "tuner/results/run_files.h"
#include "tuner/results/statistics.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

const std::string kTable = std::string(RELIEFBENCH_SOURCE_DIR) + "/tests/data/exhaustive_rocks.csv";

constexpr std::string_view kConfig = R"({
  "scenes": [{"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": ["oblique", "top"], "frame_px": [32, 32]}],
  "measure": {"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 2, "control_every": 2, "block_cases": 4},
  "sweeps": [
    {"technique": "flat"},
    {"technique": "relief", "axes": {"linear_steps": {"from": 4, "to": 64, "times": 2}, "refinement": ["none", "secant"]}},
    {"technique": "cone", "axes": {"cone_steps": {"from": 4, "to": 64, "times": 2}, "format": ["rg8", "rg16"]}}
  ]
})";

class TuneTest : public ::testing::Test {
 protected:
  [[nodiscard]] static Config config() { return parse_config(std::string(kConfig), "tune_test.json"); }
  [[nodiscard]] TuneOptions options(const std::string& name) const {
    TuneOptions options;
    options.output = folder_ / name;
    options.backend = "null";
    options.quiet = true;
    return options;
  }
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(TuneTest, a_device_that_does_not_come_back_ends_the_search_and_loses_nothing) {
  const auto tuned = [&](const std::string& name, FaultyDevices& devices) {
    TuneOptions asked = options(name);
    asked.open = devices.opener();
    return run_tune(config(), asked);
  };
  FaultyDevices counted;
  const TuneResult whole = tuned("whole", counted);
  FaultyDevices opened;
  WallSplit split;
  Session session(find_backend("null"), 0, split, {.open = opened.opener()});
  session.calibrate(config().measure.batch_ms, nullptr);
  const int before = opened.calls(FaultyDevices::draw);
  const int draws = counted.calls(FaultyDevices::draw);
  ASSERT_GT(draws, before + 50);
  for (int sixth = 0; sixth < 6; ++sixth) {  // the last draws are those of pictures, which a search can do without
    const int nth = before + sixth * (draws - before) / 6;
    SCOPED_TRACE(nth);
    const std::string name = "lost" + std::to_string(nth);
    FaultyDevices devices;
    devices.fail(FaultyDevices::draw, nth, Fault::device_lost);
    devices.fail(FaultyDevices::open, 1, Fault::other);
    EXPECT_THROW(static_cast<void>(tuned(name, devices)), DeviceGone);
    FaultyDevices healthy;
    const TuneResult again = tuned(name, healthy);
    EXPECT_EQ(again.counts.scored, whole.counts.scored);
    EXPECT_TRUE(again.is_certified());
  }
}

TEST_F(TuneTest, answers_every_budget_with_a_certificate_and_leaves_a_run) {
  TuneOptions asked = options("run");
  asked.holdout = config().scenes;
  for (SceneSpec& scene : asked.holdout) scene.heightmap.seed = 2;
  asked.holdout.front().id = "other/oblique";
  const TuneResult result = run_tune(config(), asked);
  EXPECT_TRUE(result.is_certified());
  EXPECT_EQ(result.counts.settings, 21);
  EXPECT_EQ(result.counts.scored, 21);
  ASSERT_GT(result.search.answers.size(), 2U);
  for (std::size_t i = 1; i < result.search.answers.size(); ++i) {
    EXPECT_LT(result.search.answers[i].max_error, result.search.answers[i - 1].max_error);
    EXPECT_LE(result.search.answers[i].gap, 0.02);
  }
  EXPECT_EQ(result.scene_answers.size(), 2U);
  EXPECT_EQ(result.subjects.front(), "fbm_32x32/oblique: 30 degrees, 32x32 pixels, relief depth 0.1, repeat");
  EXPECT_EQ(result.holdout.size(), 2U);
  EXPECT_EQ(schema_errors(tune_json(result), "tune"), "");
  const auto run = load_run(folder_ / "run");
  std::set<std::string> recorded;
  for (const Record& record : run.records) {
    EXPECT_EQ(record.status, Status::ok);
    recorded.insert(setting_id(parse_setting(record.case_id)));
  }
  for (const BudgetAnswer& answer : result.search.answers)
    EXPECT_TRUE(recorded.contains(result.space.candidates[answer.pick].id));
  for (const Record* record : pictured_records(run.records, config(), Pictured::shown)) {  // held-out scenes', too
    const std::string& id = record->case_id;
    for (const auto& picture : {image_path(id, "frame"), image_path(id, "error"),
                                image_path(reference_image_key(record->scene, record->backend), "frame")})
      EXPECT_TRUE(std::filesystem::exists(run.folder / picture)) << id;
  }
}

// A scene's own pick is held to the common one by the medians of the same scene's samples: never by two measurements.
TEST_F(TuneTest, a_scene_gains_nothing_over_its_own_setting_and_never_less_than_nothing) {
  const TuneResult result = run_tune(config(), options("run"));
  ASSERT_EQ(result.scene_answers.size(), 2U);
  const std::vector<TableRow> rows = case_table(load_run(folder_ / "run"));
  for (const SceneAnswer& answer : result.scene_answers) {
    ASSERT_TRUE(answer.own);
    EXPECT_GE(answer.gain, 0);
    EXPECT_NEAR(answer.gain, 1 - answer.own_ns / answer.common_ns, 1e-12);
    EXPECT_LE(answer.gain_low, answer.gain);
    EXPECT_LE(answer.gain, answer.gain_high);
    if (answer.own->setting == result.pick->setting) {
      EXPECT_EQ(answer.own_ns, answer.common_ns);
    }
    for (const auto& one :
         {std::pair(answer.own->setting, answer.own_ns), std::pair(result.pick->setting, answer.common_ns)}) {
      const auto row = std::ranges::find_if(
          rows, [&](const TableRow& r) { return r.scene == answer.scene && setting_id(r.settings) == one.first; });
      ASSERT_NE(row, rows.end());
      EXPECT_NEAR(row->frame_time->median, one.second, 1e-9 * one.second) << one.first;
    }
  }
}

TEST_F(TuneTest, with_budgets_there_is_one_answer_and_it_meets_them) {
  TuneOptions asked = options("run");
  const TuneResult all = run_tune(config(), asked);
  asked.question.max_error = {{"e_xy.p99", all.search.answers[all.search.answers.size() / 2].max_error},
                              {"missed_rate", 0.001}};
  asked.output = folder_ / "asked";
  const TuneResult one = run_tune(config(), asked);
  ASSERT_TRUE(one.pick);
  EXPECT_EQ(one.search.answers.size(), 1U);
  EXPECT_LE(one.pick->error, asked.question.max_error.front().limit);
  EXPECT_TRUE(one.is_certified());
  ASSERT_FALSE(one.rungs.empty());
  for (std::size_t i = 1; i < one.rungs.size(); ++i) EXPECT_LT(one.rungs[i].high_ns, one.rungs[i - 1].high_ns);
  EXPECT_EQ(one.rungs.back().setting, one.pick->setting);
  EXPECT_EQ(schema_errors(tune_json(one), "tune"), "");
}

TEST_F(TuneTest, where_nothing_does_the_nearest_is_named) {
  TuneOptions asked = options("run");
  asked.question.max_error = {{"e_xy.mean", 0}};
  const TuneResult result = run_tune(config(), asked);
  EXPECT_FALSE(result.pick);
  EXPECT_EQ(result.search.measured, 0);
  EXPECT_THAT(result.nearest, HasSubstr("=64"));  // the most steps come nearest
  EXPECT_THAT(result.miss, HasSubstr("e_xy.mean is "));
  EXPECT_EQ(schema_errors(tune_json(result), "tune"), "");
}

// Cut off while it scores, the search may still answer for what was scored: the rest may hold better ones.
TEST_F(TuneTest, what_was_not_scored_is_in_no_certificate) {
  int calls = 0;
  TuneOptions asked = options("run");
  asked.is_interrupted = [&] { return ++calls == 8; };  // once, in the midst of scoring
  const TuneResult result = run_tune(config(), asked);
  ASSERT_GT(result.counts.unscored, 0);
  ASSERT_GT(result.counts.scored, 1);
  ASSERT_TRUE(result.search.is_certified);  // among the scored
  ASSERT_TRUE(result.pick);
  EXPECT_FALSE(result.is_certified());
  EXPECT_EQ(
      result.claim(),
      fmt::format("not certified: {} of the 21 settings were not scored: no statement about the whole space. Of the "
                  "{} that were, every answer is within {:.2f} % of the best, with 95 % confidence",
                  result.counts.unscored, result.counts.scored, 100 * result.search.worst_gap));
  const nlohmann::json json = tune_json(result);
  EXPECT_EQ(schema_errors(json, "tune"), "");
  EXPECT_FALSE(json["certificate"]["held"]);
  EXPECT_TRUE(json["certificate"]["worst_gap"].is_null());
  EXPECT_FALSE(json["certificate"]["scored_gap"].is_null());
  EXPECT_TRUE(json["pick"]["gap"].is_null());
  for (const nlohmann::json& answer : json["answers"]) EXPECT_TRUE(answer["gap"].is_null());
}

TEST_F(TuneTest, without_an_answer_nothing_is_claimed) {
  TuneOptions asked = options("run");
  asked.is_interrupted = [] { return true; };
  const TuneResult none = run_tune(config(), asked);
  EXPECT_THAT(none.claim(), HasSubstr("no statement about the whole space"));
  EXPECT_THAT(none.claim(), ::testing::Not(HasSubstr("within")));
}

// Times are corrected once, by one rule, for the search, the records and the tables.
TEST_F(TuneTest, the_tables_medians_are_those_of_their_samples) {
  (void)run_tune(config(), options("run"));
  const std::vector<TableRow> rows = case_table(load_run(folder_ / "run"));
  ASSERT_FALSE(rows.empty());
  for (const TableRow& row : rows) {
    ASSERT_TRUE(row.frame_time) << row.case_id;
    EXPECT_NEAR(row.frame_time->median, median(row.samples_ns), 1e-9 * row.frame_time->median) << row.case_id;
  }
}

// Nothing is measured twice: a finished search, asked again, draws no batch and ends the same.
TEST_F(TuneTest, goes_on_where_it_was) {
  int calls = 0;
  TuneOptions stopped = options("run");
  stopped.is_interrupted = [&] { return ++calls > 30; };
  const TuneResult first = run_tune(config(), stopped);
  EXPECT_TRUE(first.is_stopped);
  EXPECT_FALSE(first.is_certified());
  const std::vector<Sample> before = load_run(folder_ / "run").samples;
  const TuneResult whole = run_tune(config(), options("run"));
  EXPECT_TRUE(whole.is_certified());
  const std::vector<Sample> after = load_run(folder_ / "run").samples;
  ASSERT_GT(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].case_id, before[i].case_id);
    EXPECT_EQ(after[i].frame_time_ns, before[i].frame_time_ns);
  }
  const TuneResult again = run_tune(config(), options("run"));
  EXPECT_EQ(load_run(folder_ / "run").samples.size(), after.size());
  EXPECT_EQ(tune_json(again), tune_json(whole));
}

// Nor is a record entered again, also where there are hold-outs, whose errors come from it.
TEST_F(TuneTest, a_finished_search_asked_again_leaves_its_files_as_they_are) {
  TuneOptions asked = options("run");
  asked.holdout = config().scenes;
  for (SceneSpec& scene : asked.holdout) scene.heightmap.seed = 2;
  const TuneResult first = run_tune(config(), asked);
  const std::string records = file_text(folder_ / "run" / kResultsFile);
  const std::string samples = file_text(folder_ / "run" / kSamplesFile);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(tune_json(run_tune(config(), asked)), tune_json(first));
  EXPECT_EQ(file_text(folder_ / "run" / kResultsFile), records);
  EXPECT_EQ(file_text(folder_ / "run" / kSamplesFile), samples);
}

// Whether errors are bisected depends on how fast they are: decided once, so that a search goes on among the same
// settings.
TEST_F(TuneTest, goes_on_with_the_settings_that_it_began_with) {
  TuneOptions asked = options("run");
  asked.question.max_error = {{"e_xy.p99", 1e9}};
  EXPECT_EQ(run_tune(config(), asked).counts.scored, 21);
  const std::filesystem::path info = folder_ / "run/run.json";
  nlohmann::json changed = nlohmann::json::parse(file_text(info));
  EXPECT_EQ(schema_errors(changed, "run"), "");
  ASSERT_EQ(changed.at("bisected"), false);
  changed["bisected"] = true;
  std::ofstream(info) << changed;
  for (int start = 0; start < 2; ++start) {
    const TuneResult again = run_tune(config(), asked);
    EXPECT_TRUE(again.counts.is_bisected);
    EXPECT_LT(again.counts.scored, 21);
    EXPECT_TRUE(again.is_certified());
  }
}

TEST_F(TuneTest, another_question_does_not_go_on_in_the_same_folder) {
  static_cast<void>(run_tune(config(), options("run")));
  TuneOptions other = options("run");
  other.question.epsilon = 0.05;
  EXPECT_THROW(static_cast<void>(run_tune(config(), other)), Error);
  Config fewer = config();
  fewer.scenes.pop_back();
  EXPECT_THROW(static_cast<void>(run_tune(fewer, options("run"))), Error);
}

TEST_F(TuneTest, replay_ends_like_the_search_it_replays) {
  TuneOptions asked;
  asked.quiet = true;
  const TuneResult bare = replay_tune(kTable, "", asked);
  EXPECT_TRUE(bare.is_certified());
  EXPECT_GE(bare.counts.settings, 1500);
  asked.output = folder_ / "kept";
  EXPECT_EQ(tune_json(replay_tune(kTable, "", asked)), tune_json(bare));
  EXPECT_EQ(tune_json(replay_tune(kTable, "", asked)), tune_json(bare));  // from the journal alone
  EXPECT_EQ(schema_errors(tune_json(bare), "tune"), "");
}

// kill -9 at any moment: the same command goes on, ends at the same front, and has lost nothing that was measured.
TEST_F(TuneTest, kills_end_at_the_same_front) {
  const int kills = tried(15, 100, 5);
  constexpr int kKillsOfOne = 5;
  const auto arguments = [](const std::string& output) {
    return std::vector<std::string>{"tune", "--replay", kTable, "--quiet", "-o", output};
  };
  std::chrono::duration<double> whole_s = std::chrono::hours(1);
  for (const std::string output : {"whole", "again"}) {
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(run_reliefbench(arguments(output), folder_.path()).exit_code, 0);
    whole_s = std::min<std::chrono::duration<double>>(whole_s, std::chrono::steady_clock::now() - start);
  }
  const std::string whole = file_text(folder_ / "whole/tune.json");
  std::mt19937 random(1);
  int killed = 0;
  for (int i = 0; killed < kills; ++i) {
    ASSERT_LT(i, kills) << "the search ends before it can be killed";
    const std::string output = "run" + std::to_string(i);
    std::string journal;
    for (int of_this = 0; of_this < kKillsOfOne && killed < kills; ++of_this) {
      const pid_t child = start_reliefbench(arguments(output), folder_.path());
      std::this_thread::sleep_for(whole_s * (static_cast<double>(random() % 1000) / 1000));
      kill(child, SIGKILL);
      int status = 0;
      waitpid(child, &status, 0);
      const std::string now = file_text(folder_ / (output + "/samples.jsonl"));
      ASSERT_TRUE(now.starts_with(journal.substr(0, journal.rfind('\n') + 1))) << "the journal lost lines";
      journal = now;
      if (!WIFSIGNALED(status)) break;  // it had ended
      ++killed;
    }
    ASSERT_EQ(run_reliefbench(arguments(output), folder_.path()).exit_code, 0);
    ASSERT_EQ(file_text(folder_ / (output + "/tune.json")), whole);
  }
}

TEST_F(TuneTest, the_command_refuses_what_it_cannot_do) {
  const auto refusal = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "tune");
    const CommandResult result = run_reliefbench(arguments, folder_.path());
    EXPECT_EQ(result.exit_code, 2) << result.out;
    return result.err;
  };
  EXPECT_THAT(refusal({}), HasSubstr("needs a heightmap or a config"));
  EXPECT_EQ(refusal({"typo.png"}).find("reliefbench: HEIGHTMAP: 'typo.png' is unknown"), 0U);
  EXPECT_THAT(refusal({"rokcs"}), HasSubstr("HEIGHTMAP: 'rokcs' is unknown (did you mean 'rocks'?"));
  EXPECT_THAT(refusal({"fbm", "--scene", "sideways"}), HasSubstr("--scene: view 'sideways' is unknown"));
  EXPECT_THAT(refusal({"fbm", "--frame-px", "64"}), HasSubstr("--frame-px 64: expected WIDTHxHEIGHT in pixels"));
  EXPECT_THAT(refusal({"fbm", "--frame-px", "0x64"}), HasSubstr("--frame-px: "));
  EXPECT_THAT(refusal({"fbm", "--relief-depth", "-1"}), HasSubstr("--relief-depth: "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  EXPECT_THAT(refusal({"fbm", "-o", "x", "--time-limit", "soon"}), HasSubstr("'soon'"));
  EXPECT_THAT(refusal({"fbm", "-o", "x", "--max-error", "e_xy.p98<=1"}), HasSubstr("e_xy.p98"));
  EXPECT_THAT(refusal({"fbm", "-o", "x", "--weights", "1,2"}), HasSubstr("2 given for 1"));
  EXPECT_THAT(refusal({"fbm", "-o", "x", "--scene", "sideways"}), HasSubstr("sideways"));
  EXPECT_THAT(refusal({"--replay", "nowhere"}), HasSubstr("nowhere"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x"));
}

// Where no budget is given, a replay answers the run's own: its metric may be another one than the defaults' are for.
TEST_F(TuneTest, a_replay_answers_the_budgets_of_its_run) {
  const std::filesystem::path run = null_sweep(folder_);
  nlohmann::json info = nlohmann::json::parse(file_text(run / kRunFile));
  const RecordedTable all = load_recorded(run, {});
  std::vector<double> errors;
  for (const Candidate& candidate : all.space.candidates) errors.push_back(candidate.error);
  std::ranges::sort(errors);
  const double limit = errors[errors.size() / 4];
  info["budgets"] = {fmt::format("e_xy.p95<={}", limit)};
  std::ofstream(run / kRunFile) << info.dump();
  TuneOptions asked;
  asked.quiet = true;
  const TuneResult result = replay_tune(run, "", asked);
  ASSERT_TRUE(result.pick);
  EXPECT_EQ(result.error_metric, "e_xy.p95");
  EXPECT_LE(result.pick->error, limit);
  EXPECT_GT(limit, 0);
  info["budgets"] = nlohmann::json::array({"e_xy.p95<=1e9"});
  std::ofstream(run / kRunFile) << info.dump();
  EXPECT_GT(replay_tune(run, "", asked).pick->error, limit);
}

TEST_F(TuneTest, the_command_says_no_and_names_the_nearest) {
  const CommandResult result =
      run_reliefbench({"tune", "--replay", kTable, "--max-error", "e_xy.p99<=-1", "--quiet"}, folder_.path());
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("nearest: "));
  EXPECT_THAT(result.out, HasSubstr("where -1 is asked"));
  const CommandResult late =
      run_reliefbench({"tune", "--replay", kTable, "--time-limit", "0.001s", "--quiet"}, folder_.path());
  EXPECT_EQ(late.exit_code, 4) << late.out;
  // On a device, before anything was scored.
  const CommandResult none = run_reliefbench(
      {"tune", "fbm", "--backend", "null", "--time-limit", "0.001s", "--quiet", "-o", "none"}, folder_.path());
  EXPECT_EQ(none.exit_code, 4) << none.out;
  EXPECT_THAT(none.out, ::testing::AllOf(HasSubstr("no pick yet"), HasSubstr("no statement about the whole space"),
                                         ::testing::Not(HasSubstr("within")), ::testing::Not(HasSubstr("confidence"))));
}

}  // namespace
}  // namespace reliefbench
