// Options that were misread: what is given twice, in lists, in other bytes, or where it means nothing.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "tests/cli_rig.h"
#include "tests/finished_run.h"
#include "tests/written_run.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A line of output from `begin` on, as a shell takes it, without what joins its parts.
std::string command_in(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  EXPECT_NE(at, std::string::npos) << text;
  std::string command = text.substr(at);
  for (std::size_t joint = 0; (joint = command.find(" \\\n")) != std::string::npos;) command.erase(joint, 3);
  return command.substr(0, command.find('\n'));
}

TEST_F(CliTest, a_flag_may_be_denied_and_given_twice) {
  EXPECT_THAT(run({"list", "views", "--json"}).out, StartsWith("["));
  EXPECT_THAT(run({"list", "views", "--json", "--json"}).out, StartsWith("["));
  EXPECT_THAT(run({"list", "views", "--json=false"}).out, Not(StartsWith("[")));
  EXPECT_THAT(run({"list", "views", "--json=true"}).out, StartsWith("["));
}

TEST_F(CliTest, lists_leave_the_word_after_them_alone) {
  static_cast<void>(null_sweep(folder_));
  for (const std::vector<std::string>& question :
       {std::vector<std::string>{"choose", "--max-error", "e_xy.p99<=100", "run", "run"},
        {"choose", "--max-error", "e_xy.p99<=100", "--max-error", "missed_rate<=1", "run"},
        {"choose", "--max-error", "e_xy.p99<=100", "--regret", "mean", "--weights", "2,1", "run", "run"},
        {"export", "--for", "unreal", "fbm", "--case", "relief?linear_steps=8", "-o", "shipped"},
        {"export", "--language", "glsl,hlsl", "fbm", "--case", "relief?linear_steps=8", "-o", "shipped"},
        {"sweep", "--dry-run", "--inject-slowdown", "cone:1.1", kSmoke, "--inject-slowdown", "relief:1.2", "--backend",
         "null"}}) {
    const CommandResult result = run(question);
    EXPECT_EQ(result.exit_code, 0) << question[1] << ": " << result.err;
  }
}

TEST_F(CliTest, options_of_lists_take_one_word) {
  for (const std::string option : {"--scene", "--max-error", "--holdout"})
    expect_refused({"tune", option, option == "--max-error" ? "flip<=1" : "grazing", "typo.png", "-o", "run"}, 2,
                   "HEIGHTMAP: 'typo.png' is unknown");
  expect_refused({"recommend", "r", "--max-error", "flip<=1", "word"}, 2, "was not expected: word");
}

TEST_F(CliTest, numbers_are_refused_in_words) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"bake", "fbm", "--map", "conservative", "--repeat", "0"},
        {"view", "fbm", "--tiling", "0"},
        {"view", "fbm", "--frames", "-1"},
        {"tune", "fbm", "--tiling", "inf"},
        {"tune", "fbm", "--max-time-ms", "inf", "-o", "run"},
        {"recommend", "run", "--max-time-ms", "0"},
        {"choose", "run", "--max-time-ms", "nan"},
        {"compare", "a", "b", "--rerun", "--rerun-cases", "0"}}) {
    expect_refused(command, 2, "expected a number above 0");
    EXPECT_LT(file_text(folder_ / "stderr.txt").size(), 120U);
  }
  expect_refused({"tune", "fbm", "--relief-depth", "nan"}, 2, "expected a number of at least 0");
  expect_refused({"tune", "fbm", "--epsilon", "inf", "-o", "run"}, 2, "--epsilon");
  expect_refused({"tune", "fbm", "--weights", "inf,1", "-o", "run"}, 2, "--weights 'inf': expected a number above 0");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"tune", "fbm", "-o", "run"}, {"choose", "a", "b", "--regret", "mean"}})
    for (const auto& [weights, wrong] : {std::pair("2,1,", ""), std::pair("2,,1", ""), std::pair("1,x", "x")}) {
      std::vector<std::string> words = command;
      words.insert(words.end(), {"--weights", weights});
      expect_refused(words, 2, fmt::format("--weights '{}': expected a number above 0", wrong));
    }
  for (const char* confidence : {"0.5", "1", "nan"})
    expect_refused({"tune", "fbm", "--confidence", confidence, "-o", "run"}, 2,
                   fmt::format("--confidence: '{}': expected a number between 0.5 and 1", confidence));
  for (const char* threshold : {"0", "inf"})
    expect_refused({"compare", "a", "b", "--threshold", threshold}, 2,
                   fmt::format("--threshold: '{}': expected a share above 0", threshold));
  for (const char* share : {"1", "-0.1"})
    expect_refused({"track", "check", "--db", "h.db", "--least-effect", share}, 2,
                   fmt::format("--least-effect: '{}': expected a share from 0 to 1", share));
  for (const char* nights : {"3", "-1"})
    expect_refused({"track", "check", "--db", "h.db", "--least-nights", nights}, 2,
                   fmt::format("--least-nights: '{}': expected at least 4", nights));
  // Four runs a round: their number is an int, too.
  for (const char* rounds : {"1", "600000000"})
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"compare", "a", "b", "--rerun"},
          {"track", "confirm", "--db", "h.db", "--good", "true", "--bad", "true"}}) {
      std::vector<std::string> words = command;
      words.insert(words.end(), {"--rounds", rounds});
      expect_refused(words, 2, fmt::format("--rounds: Value {} not in range 2 to 10000", rounds));
    }
  expect_refused({"sweep", kSmoke, "--inject-slowdown", "cone:inf"}, 2, "--inject-slowdown cone:inf");
  for (const char* duration : {"inf", "5x", "s", "-1m", "1mm"})
    expect_refused({"tune", "fbm", "--time-limit", duration, "-o", "run"}, 2, "--time-limit");
}

TEST_F(CliTest, tune_refuses_what_means_nothing_to_it) {
  std::filesystem::rename(null_sweep(folder_), folder_ / "recorded");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"fbm"},
                                               {"--holdout", "fbm"},
                                               {"--frame-px", "8x8"},
                                               {"--weights", "1"},
                                               {"--combine", "worst"},
                                               {"--relief-depth", "0.2"},
                                               {"--base", "0"},
                                               {"--wrap", "clamp"},
                                               {"--tiling", "2"},
                                               {"--invert"},
                                               {"--normalise"},
                                               {"--floor", "g"},
                                               {"--channel", "r"},
                                               {"--device", "0"},
                                               {"--retry-failed"}}) {
    std::vector<std::string> words{"tune", "--replay", "recorded", "--quiet", "-o", "run"};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(words, 2, (more.front() == "fbm" ? "SUBJECT" : more.front()) + ": has no meaning with --replay");
  }
  expect_refused({"tune", "--replay", "recorded", "--scene", "nope", "-o", "run"}, 2, "scene 'nope'");
  for (const std::string option : {"--channel", "--floor"})
    expect_refused({"tune", "config.json", option, "g", "-o", "run"}, 2, "a config says itself how");
}

// As a folder's name may be on Linux.
TEST_F(CliTest, paths_that_are_no_utf8_come_to_no_harm) {
  const std::string odd =
      "b\xe9"
      "d";
  std::filesystem::rename(null_sweep(folder_), folder_ / odd);
  std::filesystem::copy_file(folder_ / "config.json", folder_ / (odd + ".json"));
  write("other.csv",
        std::regex_replace(file_text(folder_ / odd / "table.csv"), std::regex(",null,null,"), ",null,other,"));
  std::filesystem::rename(folder_ / "other.csv", folder_ / (odd + ".csv"));
  write("scene.json", R"({"scenes": {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "top",
        "frame_px": [8, 8]}, "features": {"shadow": "linear", "fade": [], "lod": []}, "measure": {"samples": 1}})");
  std::filesystem::rename(folder_ / "scene.json", folder_ / ("scene" + odd + ".json"));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"bake", "fbm", "--size", "16x16", "--map", "height", "-o", odd + ".png"},
        {"recommend", odd, "--max-error", "e_xy.p99<=100"},
        {"choose", odd, odd, "--max-error", "e_xy.p99<=100"},
        {"compare", odd, odd},
        {"compare", odd, odd + ".csv"},
        {"presets", odd, "-o", "presets.json"},
        {"sweep", odd + ".json", "--dry-run", "--backend", "null"},
        {"sweep", odd + ".json", "-o", odd, "--backend", "null", "--quiet"},
        {"tune", "--replay", odd, "-o", "t" + odd, "--quiet", "--max-error", "e_xy.p99<=100"},
        {"tune", odd + ".json", "-o", "d" + odd, "--backend", "null", "--quiet", "--max-error", "e_xy.p99<=100"},
        {"require", "scene" + odd + ".json", "-o", "r" + odd, "--backend", "null", "--quiet"}}) {
    std::vector<std::string> words = command;
    words.emplace_back("--json");
    const CommandResult result = run(words);
    EXPECT_NE(result.exit_code, 3) << words[0] << ": " << result.err;
    EXPECT_FALSE(json::parse(result.out, nullptr, false).is_discarded()) << words[0] << ": " << result.err;
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / ("t" + odd) / "tune.json"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / ("d" + odd) / "tune.json"));
}

TEST_F(CliTest, a_run_is_named_so_that_a_shell_finds_it) {
  EXPECT_THAT(run({"sweep", kSmoke, "-o", "a run", "--backend", "null"}).out,
              HasSubstr("\n  reliefbench recommend 'a run'\n"));
  EXPECT_THAT(run({"merge", "a run", "-o", "the whole"}).out, HasSubstr("\n  reliefbench recommend 'the whole'\n"));
  write("hasty.json", R"({"scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "top",
        "frame_px": [16, 16]}], "measure": {"samples": 1, "timeout_s": 1e-12}, "sweeps": [{"technique": "flat"}]})");
  const CommandResult failed = run({"sweep", "hasty.json", "-o", "two\nlines", "--backend", "null", "--quiet"});
  EXPECT_EQ(failed.exit_code, 5);
  EXPECT_EQ(std::ranges::count(failed.err, '\n'), 1) << failed.err;
  EXPECT_THAT(failed.err, StartsWith("reliefbench: 1 of 1 cases failed: 1 timeout; the reasons are in two\\nlines/"));
}

TEST_F(CliTest, a_run_in_other_frames_can_be_measured_again) {
  write("config.json", file_text(kSmoke));
  ASSERT_EQ(run({"sweep", "config.json", "-o", "out", "--backend", "null", "--frame-px", "48x32"}).exit_code, 0);
  const CommandResult answer = run({"recommend", "out", "--max-error", "e_xy.p99<=100"});
  const std::string again = command_in(answer.out, "reliefbench sweep config.json");
  EXPECT_THAT(again, HasSubstr(" --frame-px 48x32 "));
  EXPECT_THAT(
      output_of("cd " + folder_.path().string() + " && " + RELIEFBENCH_BINARY + again.substr(11) + " --dry-run --json"),
      HasSubstr("\"cases\""));
}

TEST_F(CliTest, a_dry_run_says_how_large_frames_are_in_json_too) {
  write("config.json", R"({"scenes": [{"heightmap": "fbm", "views": "top"}], "sweeps": [{"technique": "flat"}]})");
  const std::vector<std::string> words{"sweep", "config.json", "--dry-run", "--backend", "null", "--json"};
  EXPECT_THAT(json::parse(run(words).out).at("frames").get<std::string>(), StartsWith("frames are 256x256"));
  EXPECT_FALSE(json::parse(run({"sweep", kSmoke, "--dry-run", "--backend", "null", "--json"}).out).contains("frames"));
}

TEST_F(CliTest, a_stress_that_cannot_begin_leaves_no_folder) {
  expect_refused({"stress", "--simulate-filter", "0", "-o", "run"}, 2, "--simulate-filter");
  expect_refused({"stress", "--filter", "nope", "--backend", "null", "-o", "run", "--quiet"}, 2, "'nope'");
  expect_refused({"stress", "--device", "99", "--backend", "null", "-o", "run", "--quiet"}, 3, "99");
}

TEST_F(CliTest, compare_of_one_device_has_no_fronts) {
  std::filesystem::rename(null_sweep(folder_), folder_ / "out");
  expect_refused({"compare", "out", "out", "--error", "flip"}, 2, "--error is of several devices");
}

// Google Benchmark's own, of its programs.
TEST_F(CliTest, variables_of_google_benchmark_are_not_heeded) {
  write("mine.json", "mine");
  const std::map<std::string, std::string> told{{"BENCHMARK_REPETITIONS", "2"},
                                                {"BENCHMARK_OUT", "mine.json"},
                                                {"BENCHMARK_MIN_WARMUP_TIME", "0.001"},
                                                {"BENCHMARK_ENABLE_RANDOM_INTERLEAVING", "true"},
                                                {"BENCHMARK_REPORT_AGGREGATES_ONLY", "true"},
                                                {"BENCHMARK_FILTER", "nothing"},
                                                {"BENCHMARK_CONTEXT", "who=me"}};
  const auto sweep = [&](const std::string& output, const std::map<std::string, std::string>& environment) {
    return run_reliefbench({"sweep", kSmoke, "-o", output, "--backend", "null", "--quiet"}, folder_.path(),
                           {.environment = environment, .before_start = [] { alarm(60); }});
  };
  EXPECT_EQ(sweep("told", told).exit_code, 0);
  EXPECT_EQ(sweep("listed", {{"BENCHMARK_LIST_TESTS", "true"}}).exit_code, 0);
  EXPECT_EQ(sweep("plain", {}).exit_code, 0);
  EXPECT_EQ(file_text(folder_ / "mine.json"), "mine");
  const auto cases = [&](const std::string& folder) {
    std::vector<std::string> ids;
    for (const Sample& sample : load_run(folder_ / folder).samples) ids.push_back(sample.case_id.text());
    return ids;
  };
  EXPECT_EQ(cases("told"), cases("plain"));
  EXPECT_EQ(cases("listed"), cases("plain"));
  const json context = json::parse(file_text(folder_ / "told/benchmark.json")).at("context");
  for (const char* key : {"executable", "who"}) EXPECT_FALSE(context.contains(key)) << key;
}

class TunedTest : public CliTest {
 protected:
  TunedTest() {
    std::filesystem::rename(null_sweep(folder_), folder_ / "out");
    tuned_ = run({"tune", "config.json", "--backend", "null", "--max-error", "e_xy.p95<=2", "-o", "t", "--quiet"});
  }
  CommandResult tuned_;
};

TEST_F(TunedTest, view_draws_the_pick_of_a_tune) {
  ASSERT_EQ(tuned_.exit_code, 0) << tuned_.err;
  const std::string pick = json::parse(file_text(folder_ / "t/tune.json")).at("pick").at("setting");
  const CommandResult drawn = run({"view", "--tune", "t", "--backend", "null", "--png", "view.png"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(drawn.out, StartsWith(named(parse_setting(pick))));
  expect_refused({"view", "--tune", "nowhere"}, 2, "nowhere");
  expect_refused({"view", "bricks", "--tune", "t"}, 2, "the setting was measured on fbm");
  expect_refused({"view", "config.json", "--tune", "t", "--scene", "nope"}, 2, "nope");
  expect_refused({"view", "t", "--tune", "run2"}, 2, "there are two runs: t and --tune run2");
}

TEST_F(TunedTest, a_scene_that_a_run_has_not_is_named_with_those_that_it_has) {
  expect_refused({"export", "--tune", "t", "--scene", "nope", "-o", "run"}, 2,
                 "--scene nope: t has no such scene (it has fbm_32x32/oblique)");
  expect_refused({"recommend", "t", "--scene", "nope"}, 2,
                 "--scene nope: the run has no such scene (it has fbm_32x32/oblique)");
  expect_refused({"tune", "config.json", "--scene", "nope", "--backend", "null", "-o", "run"}, 2,
                 "--scene nope: config.json has no such scene (it has fbm_32x32/oblique)");
}

// A case that failed on one backend once hid that it was measured on another.
TEST_F(CliTest, of_a_cases_records_those_that_were_measured_count) {
  std::filesystem::rename(null_sweep(folder_), folder_ / "mixed");
  reliefbench::Run run = load_run(folder_ / "mixed");
  const Record measured = run.records.at(5);
  const auto copy_on = [&](const std::string& backend, Status status) {
    Record record = measured;
    record.case_id.replace(record.case_id.find("backend=null"), 12, "backend=" + backend);
    record.backend = backend;
    record.status = status;
    if (status == Status::ok) return record;
    record.reason = "made up";
    record.frame_time.reset();
    record.error.reset();
    return record;
  };
  run.samples.clear();
  run.records.insert(run.records.begin(), copy_on("opengl", Status::unsupported));
  run.records.push_back(copy_on("vulkan", Status::ok));
  write_run(run);
  const std::string key = setting_key(settings_of(measured.technique, measured.params));
  const CommandResult shipped = this->run({"export", "--run", "mixed", "--case", key, "-o", "out", "--json"});
  ASSERT_EQ(shipped.exit_code, 0) << shipped.err;
  EXPECT_EQ(json::parse(shipped.out).at("evidence").at("backend"), "null");

  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  write_run(run);
  expect_refused({"export", "--run", "mixed", "--case", key, "-o", "run2"}, 2, "was not measured: unsupported made up");
}

}  // namespace
}  // namespace reliefbench
