// The built binary, as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "kernels/image/image.h"
#include "tests/cli_rig.h"
#include "tests/finished_run.h"
#include "tests/hand_made_stress.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

TEST_F(CliTest, every_command_has_help_with_an_example) {
  for (const std::string& command : command_names(folder_.path())) {
    const CommandResult result = run({command, "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("reliefbench " + command)) << command << " shows no example";
  }
}

TEST_F(CliTest, no_line_is_wider_than_120_characters) {
  static_cast<void>(null_sweep(folder_));
  std::vector<std::vector<std::string>> commands{{"recommend", "run", "--max-error", "e_xy.p95<=100"},
                                                 {"recommend", "run", "--max-error", "e_xy.p95<=0"},
                                                 {"recommend", "run", "--max-time-ms", "100"},
                                                 {"compare", "run", "run", "--all"},
                                                 {"presets", "run", "-o", "presets.json"},
                                                 {"sweep", "config.json", "--dry-run", "--backend", "null"},
                                                 {"tune", "--replay", "run", "--quiet"},
                                                 {"tuners", "run", "--seeds", "1", "--certificates", "1"},
                                                 {"devices"},
                                                 {"--help"}};
  for (const std::string what : {"techniques", "maps", "metrics", "heightmaps", "formats"})
    commands.push_back({"list", what});
  for (const std::string& command : command_names(folder_.path())) commands.push_back({command, "--help"});
  for (const std::vector<std::string>& command : commands) {
    std::istringstream lines(run(command).out);
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) {
      EXPECT_LE(line.size(), 120U) << command.front() << ": " << line;
      if (command.back() == "--help") {  // words of an option go on under where they began
        EXPECT_LE(std::min(line.find_first_not_of(' '), line.size()), 30U) << command.front() << ": " << line;
      }
    }
    EXPECT_GT(count, 0) << command.front() << " " << command.back();
  }
}

// What a person reads is short; its key leads back to the whole.
TEST_F(CliTest, settings_are_short_and_their_keys_are_taken) {
  static_cast<void>(null_sweep(folder_, R"("oblique", "top")"));
  const std::vector<std::string> question{"recommend",   "run",     "--max-error",
                                          "e_xy.p95<=2", "--scene", "fbm_32x32/oblique"};
  std::vector<std::string> verbose = question;
  verbose.emplace_back("--verbose");
  const std::string text = run(question).out;
  const std::size_t open = text.find('[', text.find("  pick"));
  const std::string key = text.substr(open + 1, text.find(']', open) - open - 1);
  ASSERT_EQ(key.size(), 8U) << text;
  const std::string whole = run(verbose).out;
  const std::size_t pick = whole.find_first_not_of(' ', whole.find("  pick") + 6);
  const std::string id = whole.substr(pick, whole.find('\n', pick) - pick);
  EXPECT_NE(id.find('?'), std::string::npos) << whole;
  EXPECT_EQ(text.find('?', open), text.find("?*'"));  // of the command that measures it again
  EXPECT_THAT(text, HasSubstr("out/again_" + key));   // a folder of its own: another pick's command is not refused

  const CommandResult plan = run({"sweep", "config.json", "--dry-run", "--backend", "null", "--case", key, "--json"});
  const nlohmann::json cases = nlohmann::json::parse(plan.out).at("cases");
  ASSERT_EQ(cases.size(), 2U) << plan.out;  // in each of the two scenes
  EXPECT_EQ(setting_id(parse_setting(cases[0].get<std::string>())), id);

  const CommandResult exported =
      run({"export", "--run", "run", "--case", key, "--scene", "fbm_32x32/oblique", "-o", "shipped", "--json"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  const CommandResult unclear = run({"export", "--run", "run", "--case", key, "-o", "other"});
  EXPECT_EQ(unclear.exit_code, 2);
  EXPECT_THAT(unclear.err, HasSubstr("choose by --scene"));
  EXPECT_EQ(run({"sweep", "config.json", "--dry-run", "--case", "pick"}).exit_code, 2);
  EXPECT_EQ(run({"sweep", "config.json", "--dry-run", "--backend", "null", "--case", "00000000"}).exit_code, 2);
}

TEST_F(CliTest, bad_usage_exits_2_with_one_line) {
  expect_refused({}, 2, "subcommand");
  expect_refused({"sweep"}, 2, "CONFIG");
  expect_refused({"sweep", kSmoke, "--backend", "metal", "-o", "run"}, 2, "metal");
  expect_refused({"sweep", kSmoke}, 2, "-o");
  for (const char* sampler : {"0", "15", "6:", "6:up", "x:round", "6x"})
    expect_refused({"stress", "--simulate-filter", sampler}, 2, "--simulate-filter");
  expect_refused({"stress", "--random", "0"}, 2, "--random");
  expect_refused({"stress", "--random", "3", "extremes.json"}, 2, "EXTREMES");
  expect_refused({"stress", "--seed", "3"}, 2, "--random");
  expect_refused({"nonsense"}, 2, "nonsense");
}

TEST_F(CliTest, a_bad_config_is_refused_with_line_and_key) {
  write("config.json", "{\n\"scenes\": [{\"heightmap\": \"fbm\", \"views\": \"top\"}],\n\"swoops\": []}");
  expect_refused({"sweep", "config.json", "-o", "run", "--backend", "null"}, 2, "config.json:3: key 'swoops'");
  expect_refused({"sweep", "none.json", "-o", "run", "--backend", "null"}, 2, "none.json");
}

TEST_F(CliTest, a_bad_heightmap_is_refused_by_name) {
  expect_refused({"sweep", config_on("missing.png"), "-o", "run", "--backend", "null"}, 2, "missing.png");

  write_png(folder_ / "whole.png", 64, 64, std::vector<std::uint8_t>(64 * 64 * 4, 99));
  const std::string png = file_text(folder_ / "whole.png");
  write("cut.png", png.substr(0, png.size() / 2));
  expect_refused({"sweep", config_on("cut.png"), "-o", "run", "--backend", "null"}, 2, "cut.png");

  write_png(folder_ / "dot.png", 1, 1, std::vector<std::uint8_t>(4, 99));
  expect_refused({"sweep", config_on("dot.png"), "-o", "run", "--backend", "null"}, 2, "at least 2x2 is needed");
}

TEST_F(CliTest, an_unwritable_folder_and_a_missing_device_are_refused) {
  write("file", "");
  expect_refused({"sweep", kSmoke, "-o", "file/run", "--backend", "null"}, 2, "file/run");
  for (const std::string backend : {"opengl", "vulkan", "null"})
    expect_refused({"sweep", kSmoke, "-o", "run", "--backend", backend, "--device", "99"}, 3, "99");
}

TEST_F(CliTest, a_dry_run_prints_the_plan_and_writes_nothing) {
  const CommandResult result = run({"sweep", kSmoke, "--backend", "null", "--dry-run", "-o", "run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("cases, "));
  EXPECT_THAT(result.out, HasSubstr("cone cone_steps=16 ["));
  EXPECT_THAT(run({"sweep", kSmoke, "--backend", "null", "--dry-run", "--verbose"}).out,
              HasSubstr("cone@fbm_32x32/oblique?cone_steps=16"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
  const CommandResult json = run({"sweep", kSmoke, "--backend", "null", "--dry-run", "--json"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("cases").size(), 9U);
}

// It takes some two and a half minutes on two cores, where half a minute was promised.
TEST_F(CliTest, a_dry_run_promises_no_less_time_than_the_quickstart_takes) {
  const CommandResult plan = run({"sweep", std::string(RELIEFBENCH_SOURCE_DIR) + "/configs/quickstart.json",
                                  "--dry-run", "--json", "--backend", "all"});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  const nlohmann::json json = nlohmann::json::parse(plan.out);
  ASSERT_EQ(json.at("cases").size(), 378U);
  EXPECT_GT(json.at("estimated_software_s"), 100);
  EXPECT_LT(json.at("estimated_software_s"), 300);
}

/// The cases of a run, all of them ok in the end. One stands twice only where two ends in it were taken for its fault
/// (RecordBook::enter_death): one of any two lines of a case is `crashed`.
std::set<std::string> case_ids(const std::filesystem::path& run) {
  std::map<std::string, std::string> statuses;
  std::istringstream in(file_text(run / "results.jsonl"));
  for (std::string line; std::getline(in, line);) {
    const nlohmann::json record = nlohmann::json::parse(line);
    const std::string now = record.at("status");
    std::string& before = statuses[record.at("case")];
    EXPECT_TRUE(before.empty() || (before == "crashed") != (now == "crashed")) << line;
    before = now;
  }
  std::set<std::string> ids;
  for (const auto& [id, status] : statuses) {
    EXPECT_EQ(status, "ok") << id;
    ids.insert(id);
  }
  return ids;
}

TEST_F(CliDeviceAudit, killed_at_any_moment_it_ends_with_the_same_cases) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "whole", "--backend", "opengl"}).exit_code, 0);
  const auto whole = std::chrono::steady_clock::now() - start;
  for (const int percent : {10, 25, 40, 55, 70, 85}) {
    const pid_t child = start_reliefbench({"sweep", kSmoke, "-o", "killed", "--backend", "opengl"}, folder_.path());
    std::this_thread::sleep_for(whole * percent / 100);
    kill(child, SIGKILL);
    wait_for(child, folder_.path());
  }
  const CommandResult last = run({"sweep", kSmoke, "-o", "killed", "--backend", "opengl"});
  EXPECT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(case_ids(folder_ / "killed"), case_ids(folder_ / "whole"));
}

// A software rasteriser takes seconds for a frame of the second setting; nothing can end it, and the sweep goes on.
TEST_F(CliDeviceAudit, a_frame_that_does_not_end_in_time_ends_its_case) {
  write("slow.json", R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 64, "height": 64}, "views": "oblique", "frame_px": [768, 768]}],
    "measure": {"samples": 2, "batch_ms": 1, "warmup_batches_max": 1, "flicker_frames": 0, "timeout_s": 1},
    "sweeps": [{"technique": "relief", "axes": {"linear_steps": [2, 1024], "refinement": "none", "loop": "fixed",
                                                "filter": "manual"}}]})");
  for (const std::string backend : {"vulkan", "opengl"}) {
    const auto start = std::chrono::steady_clock::now();
    const CommandResult result = run({"sweep", "slow.json", "-o", backend, "--backend", backend, "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::minutes(1));
    std::map<std::string, std::string> reasons;
    std::istringstream in(file_text(folder_ / backend / "results.jsonl"));
    for (std::string line; std::getline(in, line);) {
      const nlohmann::json record = nlohmann::json::parse(line);
      reasons[record.at("status")] = record.value("reason", "");
    }
    ASSERT_TRUE(reasons.contains("ok")) << result.out;
    if (!reasons.contains("timeout"))
      GTEST_SKIP() << backend << " draws the slow frame in its second: nothing was left to time out";
    EXPECT_THAT(reasons.at("timeout"), HasSubstr("did not end within 1 s"));
  }
}

TEST_F(CliTest, a_run_compares_with_itself_as_the_same) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "null"}).exit_code, 0);
  const CommandResult same = run({"compare", "out", "out"});
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "flat", "--backend", "null", "--filter", "flat@*"}).exit_code, 0);
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "cone", "--backend", "null", "--filter", "cone@*"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "flat", "cone"}).exit_code, 5);
}

// A zero time once made `compare` rank 0/0 for ever, and another backend than the id's made it die.
TEST_F(CliTest, times_and_backends_that_cannot_be_are_refused_with_file_and_line) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "good", "--backend", "null"}).exit_code, 0);
  const auto refused = [&](const std::string& file, const std::string& before, const std::string& after,
                           const std::string& words) {
    std::filesystem::remove_all(folder_ / "bad");
    std::filesystem::copy(folder_ / "good", folder_ / "bad", std::filesystem::copy_options::recursive);
    spoil(folder_ / "bad" / file, before, after);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"compare", "good", "bad"}, {"recommend", "bad"}, {"presets", "bad", "-o", "p.json"}})
      expect_refused(command, 2, "bad/" + file + ":1: " + words);
  };
  refused("samples.jsonl", R"("frame_time_ns":)", R"("frame_time_ns":0,"x":)", "'frame_time_ns' is 0");
  refused("samples.jsonl", R"("frame_time_ns":)", R"("frame_time_ns":-3,"x":)", "'frame_time_ns' is -3");
  refused("results.jsonl", R"("median":)", R"("median":0.0,"x":)", "'median' is 0");
  refused("results.jsonl", R"("ci_high":)", R"("ci_high":-1,"x":)", "'ci_high' is -1");
  refused("results.jsonl", R"("ci_low":)", R"("ci_low":1e300,"x":)", "'ci_low' is 1e+300, above 'ci_high'");
  refused("results.jsonl", R"("backend":"null")", R"("backend":"vulkan")",
          "'backend' is 'vulkan', but the case's id says 'null'");
}

TEST_F(CliTest, presets_take_several_runs) {
  for (const std::string technique : {"cone", "relief"})
    ASSERT_EQ(run({"sweep", kSmoke, "-o", technique, "--backend", "null", "--filter", technique + "@*"}).exit_code, 0);
  const CommandResult made = run({"presets", "cone", "relief", "-o", "p.json", "--constraint", "e_xy.p99<=100"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(nlohmann::json::parse(file_text(folder_ / "p.json")).at("runs").size(), 2U);
}

TEST_F(CliTest, presets_of_a_run_can_be_swept) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "null"}).exit_code, 0);
  const CommandResult made = run({"presets", "out", "-o", "presets.json", "--header", "presets.h", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(nlohmann::json::parse(made.out), nlohmann::json::parse(file_text(folder_ / "presets.json")));
  EXPECT_THAT(file_text(folder_ / "presets.h"), HasSubstr("#define RELIEF_NULL_NULL_Q100_TECHNIQUE"));
  write("again.json", R"({"scenes": [{"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": "oblique",
                          "frame_px": [64, 64]}], "sweeps": [{"presets": "presets.json", "quality": [0, 100]}]})");
  EXPECT_EQ(run({"sweep", "again.json", "-o", "again", "--backend", "null"}).exit_code, 0);
  EXPECT_GE(case_ids(folder_ / "again").size(), 1U);
  // Other presets make another run of the same config.
  write("presets.json", file_text(folder_ / "presets.json") + " ");
  EXPECT_EQ(run({"sweep", "again.json", "-o", "again", "--backend", "null"}).exit_code, 2);

  expect_refused({"presets", "out"}, 2, "--output");
  expect_refused({"presets", "nowhere", "-o", "p.json"}, 2, "nowhere");
  expect_refused({"presets", "out", "-o", "p.json", "--constraint", "e_xy.max<=1e-12"}, 1, "e_xy.max<=");
}

TEST_F(CliTest, tuners_are_compared_on_a_folder_or_its_table) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "null"}).exit_code, 0);
  const CommandResult folder = run({"tuners", "out", "--seeds", "2", "--share", "0.5", "--json", "-o", "t.html"});
  ASSERT_EQ(folder.exit_code, 0) << folder.err;
  EXPECT_EQ(nlohmann::json::parse(folder.out).at("seeds"), 2);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "t.html"));
  const CommandResult table = run({"tuners", "out/table.csv", "--seeds", "2"});
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("worst regret"));
  expect_refused({"tuners", "out", "--seeds", "0"}, 2, "--seeds");
  expect_refused({"tuners", "out", "--scene", "rocks/top"}, 2, "rocks/top");
  write("broken.csv", "case,technique\na,cane\n");
  expect_refused({"tuners", "broken.csv"}, 2, "broken.csv:1");
}

TEST_F(CliTest, a_report_takes_the_extremes_in_or_writes_their_page_again) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "a sweep", "--backend", "null"}).exit_code, 0);
  write_hand_made_stress(folder_ / "a stress");
  const CommandResult both = run({"report", "a sweep", "--stress", "a stress", "-o", "both.html"});
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_THAT(file_text(folder_ / "both.html"), HasSubstr("needs --large"));
  const std::string page = file_text(folder_ / "a stress/stress.html");
  std::filesystem::remove(folder_ / "a stress/stress.html");
  EXPECT_EQ(run({"report", "a stress"}).out, "a stress/stress.html\n");
  EXPECT_EQ(file_text(folder_ / "a stress/stress.html"), page);

  expect_refused({"report", "a sweep", "a stress", "-o", "x.html"}, 2, "a stress holds stress.json and no run");
  expect_refused({"report", "a stress", "--stress", "a stress"}, 2, "--stress");
  expect_refused({"report", "a sweep", "--stress", "a sweep"}, 2, "a sweep/stress.json");
  write("a stress/stress.json", page.substr(0, 99));
  expect_refused({"report", "a stress", "-o", "x.html"}, 2, "a stress/stress.json: torn");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.html"));
}

TEST_F(CliTest, lists_come_from_the_registries) {
  for (const std::string what : {"techniques", "maps", "metrics", "formats", "heightmaps"}) {
    const CommandResult result = run({"list", what, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_GT(nlohmann::json::parse(result.out).size(), 2U) << what;
    EXPECT_EQ(run({"list", what}).exit_code, 0);
  }
}

}  // namespace
}  // namespace reliefbench
