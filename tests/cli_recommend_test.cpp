// `recommend`, as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "kernels/trace/technique.h"
#include "tests/cli_rig.h"
#include "tests/finished_run.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

TEST_F(CliDeviceAudit, recommend_answers_or_says_how_near_it_came) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "opengl"}).exit_code, 0);
  const CommandResult yes = run({"recommend", "out", "--max-error", "e_xy.p99<=0.5", "--json"});
  EXPECT_EQ(yes.exit_code, 0) << yes.err;
  EXPECT_FALSE(nlohmann::json::parse(yes.out).empty());
  const CommandResult no = run({"recommend", "out", "--max-error", "e_xy.max<=1e-9"});
  EXPECT_EQ(no.exit_code, 1);
  EXPECT_THAT(no.out + no.err, HasSubstr("e_xy.max is"));
  EXPECT_EQ(run({"recommend", "out", "--max-error", "beauty<=1"}).exit_code, 2);
  EXPECT_EQ(run({"recommend", "nowhere"}).exit_code, 2);
}

TEST_F(CliTest, recommend_says_what_its_intervals_cover) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "null"}).exit_code, 0);
  const nlohmann::json smoke = nlohmann::json::parse(file_text(kSmoke), nullptr, true, true);
  const int samples = smoke.at("measure").at("samples");
  ASSERT_LT(samples, 6);  // too few for 95 %
  const CommandResult text = run({"recommend", "out", "--max-error", "e_xy.p99<=100"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out.find("95 %"), std::string::npos) << text.out;
  EXPECT_THAT(text.out, HasSubstr(samples == 3 ? "; 75 %]" : "; 93.8 %]"));
  const CommandResult json = run({"recommend", "out", "--max-error", "e_xy.p99<=100", "--json"});
  EXPECT_LT(nlohmann::json::parse(json.out).at("answers").at(0).at("pick").at("frame_time_ns").at("coverage"), 0.95);
}

// No relief at all takes the least time, and was once offered as the simplest.
TEST_F(CliTest, recommend_within_a_time_keeps_to_the_budgets_of_the_run) {
  static_cast<void>(null_sweep(folder_));
  const CommandResult within = run({"recommend", "run", "--max-time-ms", "100"});
  EXPECT_EQ(within.exit_code, 0) << within.err;
  EXPECT_THAT(within.out, HasSubstr("  simplest    relief "));
  const CommandResult json = run({"recommend", "run", "--max-time-ms", "100", "--json"});
  const nlohmann::json question = nlohmann::json::parse(json.out).at("question");
  EXPECT_EQ(question.at("simplest_budgets"), nlohmann::json({"e_xy.p99<=0.5", "missed_rate<=0.001"}));
  EXPECT_EQ(question.at("budgets").size(), question.at("error_metric") == "e_xy.p99" ? 1U : 2U);
  const CommandResult asked =
      run({"recommend", "run", "--max-time-ms", "100", "--max-error", "missed_rate<=1", "--json"});
  EXPECT_EQ(nlohmann::json::parse(asked.out).at("question").at("budgets"), nlohmann::json({"missed_rate<=1"}));
  const CommandResult choice = run({"choose", "run", "--max-time-ms", "100", "--error", "e_xy.p99", "--json"});
  EXPECT_EQ(nlohmann::json::parse(choice.out).at("budgets"), nlohmann::json({"missed_rate<=0.001"}))
      << "but for that on the error itself";
}

// Of no pixel every error is 0: the fastest setting, no relief at all, was the pick.
TEST_F(CliTest, a_camera_that_looks_past_the_relief_measures_nothing) {
  write("up.json", R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "frame_px": [16, 16],
                "views": {"id": "up", "elevation_deg": -30, "distance": 1, "fov_deg": 20}}],
    "sweeps": [{"technique": "flat"}, {"technique": "relief"}]})");
  const CommandResult sweep = run({"sweep", "up.json", "-o", "up", "--backend", "null"});
  EXPECT_EQ(sweep.exit_code, 5);
  EXPECT_THAT(sweep.err, HasSubstr("2 unsupported"));
  EXPECT_THAT(run({"recommend", "up"}).out, HasSubstr("the camera looks past the relief"));
  EXPECT_NE(run({"tune", "up.json", "--backend", "null", "-o", "tuned", "--quiet"}).exit_code, 0);
}

TEST_F(CliTest, choose_names_the_scenes_that_there_are) {
  static_cast<void>(null_sweep(folder_));
  const CommandResult none = run({"choose", "run", "--scene", "nope"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--scene nope: the runs have no such scene (they have fbm_32x32/"));
}

TEST_F(CliTest, recommend_prices_a_heightmap_that_changes) {
  static_cast<void>(null_sweep(folder_));
  // A map of heights alone has to be packed, too.
  for (const Record& record : load_run(folder_.path() / "run").records)
    EXPECT_EQ(record.bake_time_ns > 0, find_technique(record.technique).reads_map()) << record.case_id;
  const CommandResult text = run({"recommend", "run", "--max-error", "e_xy.p99<=100", "--rebake-every", "4"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("Each frame bears its share of a bake every 4 frames"));
  const CommandResult json = run({"recommend", "run", "--max-error", "e_xy.p99<=100", "--rebake-every", "4", "--json"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("question").at("rebake_every"), 4);
  for (const char* none : {"0", "-3", "1.5", "often"})
    EXPECT_EQ(run({"recommend", "run", "--rebake-every", none}).exit_code, 2) << none;
}

TEST_F(CliTest, recommend_says_whose_bake_a_frame_bears) {
  static_cast<void>(null_sweep(folder_));
  const std::vector<std::string> asked{"recommend", "run", "--max-error", "e_xy.p99<=100", "--rebake-every", "4"};
  EXPECT_THAT(run(asked).out, ::testing::Not(HasSubstr("by the device")));
  const std::filesystem::path file = folder_ / "run" / kResultsFile;
  std::string lines;
  for (Record record : load_run(folder_ / "run").records) {
    if (record.bake_time_ns > 0) record.device_bake_ns = 2e6;
    lines += nlohmann::json(record).dump() + "\n";
  }
  std::ofstream(file) << lines;
  EXPECT_THAT(run(asked).out, ::testing::ContainsRegex("   bake 2[.0]* ms by the device"));
}

TEST_F(CliTest, recommend_holds_frames_of_several_sizes_to_one_another) {
  const std::string config = R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "top", "frame_px": [16, 16]},
               {"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": "top", "frame_px": OTHER}],
    "measure": {"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 2},
    "sweeps": [{"technique": "parallax"}]})";
  for (const std::string px : {"[16, 16]", "[32, 16]"}) {
    write("config.json", std::string(config).replace(config.find("OTHER"), 5, px));
    const std::string out = px == "[16, 16]" ? "alike" : "unlike";
    ASSERT_EQ(run({"sweep", "config.json", "-o", out, "--backend", "null"}).exit_code, 0);
    const std::vector<std::string> ask = {"recommend", out, "--max-error", "e_xy.p99<=100"};
    EXPECT_EQ(run(ask).out.find("ns/px") != std::string::npos, out == "unlike");
    const CommandResult json = run({"recommend", out, "--max-error", "e_xy.p99<=100", "--json"});
    const nlohmann::json answers = nlohmann::json::parse(json.out).at("answers");
    ASSERT_EQ(answers.size(), 2U);
    EXPECT_DOUBLE_EQ(answers[0].at("ns_per_px"),
                     answers[0]["pick"]["frame_time_ns"]["median"].get<double>() / (16.0 * 16));
  }
}

TEST_F(CliTest, recommend_and_tune_say_what_ties_with_their_pick) {
  static_cast<void>(null_sweep(folder_));
  EXPECT_THAT(run({"recommend", "run", "--max-error", "e_xy.p95<=2"}).out,
              ::testing::AllOf(HasSubstr("\n  tie         "), HasSubstr("the pick is the simplest and smallest")));
  EXPECT_THAT(run({"tune", "config.json", "--backend", "null", "--max-error", "e_xy.p95<=2", "-o", "t", "--quiet"}).out,
              ::testing::AllOf(HasSubstr("\n  tie with "), HasSubstr("the pick is the simpler or smaller")));
}

TEST_F(CliTest, recommend_names_no_command_that_would_measure_something_else) {
  write("config.json", file_text(kSmoke));
  ASSERT_EQ(run({"sweep", "config.json", "-o", "out", "--backend", "null"}).exit_code, 0);
  const std::vector<std::string> recommend = {"recommend", "out", "--max-error", "e_xy.p99<=100"};
  EXPECT_THAT(run(recommend).out, HasSubstr("reliefbench sweep config.json"));
  spoil(folder_ / "config.json", "\"smoke\"", "\"another\"");
  EXPECT_EQ(run(recommend).out.find("reliefbench sweep"), std::string::npos);
  std::filesystem::remove(folder_ / "config.json");
  EXPECT_EQ(run(recommend).out.find("reliefbench sweep"), std::string::npos);
}

TEST_F(CliTest, the_folder_of_a_tune_is_taken_for_what_it_is) {
  const std::vector<std::string> bound = {"--max-error", "e_xy.p99<=5"};
  ASSERT_NE(
      run({"tune", kSmoke, "-o", "tune", "--backend", "null", bound[0], bound[1], "--time-limit", "20s", "--quiet"})
          .exit_code,
      2);
  const CommandResult answer = run({"recommend", "tune"});
  EXPECT_EQ(answer.exit_code, 0) << answer.out << answer.err;
  EXPECT_THAT(answer.out, HasSubstr("The fastest with e_xy.p99<=5"));  // what was asked of tune
  EXPECT_THAT(answer.out, HasSubstr("the settings that tune answers with"));
  EXPECT_EQ(answer.out.find("no technique simpler"), std::string::npos);
  const CommandResult shipped = run({"export", "--tune", "tune", "--for", "unreal", "-o", "shipped", "--json"});
  EXPECT_EQ(shipped.exit_code, 0) << shipped.err;
  EXPECT_THAT(shipped.out,
              ::testing::AllOf(::testing::HasSubstr("\"run\": \"tune\""), ::testing::HasSubstr("\"same_scene\": true"),
                               ::testing::HasSubstr("unreal/Relief.usf")));
  EXPECT_EQ(run({"export", "--tune", "nowhere", "-o", "shipped"}).exit_code, 2);
  const CommandResult presets = run({"presets", "tune", "-o", "p.json"});
  EXPECT_EQ(presets.exit_code, 0) << presets.err;
  const nlohmann::json levels = nlohmann::json::parse(file_text(folder_ / "p.json")).at("devices").at(0).at("levels");
  EXPECT_LT(levels.size(), 11U);  // no two of them equal
  for (std::size_t i = 1; i < levels.size(); ++i)
    EXPECT_TRUE(levels[i]["technique"] != levels[i - 1]["technique"] || levels[i]["params"] != levels[i - 1]["params"]);
  if (levels.size() < 3) {
    EXPECT_THAT(presets.err, HasSubstr("a tune's folder holds only the settings that it answers with"));
  }
}

}  // namespace
}  // namespace reliefbench
