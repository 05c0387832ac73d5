// The built binary, as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "kernels/image/image.h"
#include "tests/command.h"
#include "tests/hand_made_stress.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kSource = RELIEFBENCH_SOURCE_DIR;
const std::string kSmoke = (kSource / "configs/smoke.json").string();

class CliTest : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments) const {
    return run_reliefbench(arguments, folder_.path());
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  [[nodiscard]] std::string config_on(const std::string& heightmap) const {
    const std::string name = "config.json";
    write(name,
          R"({"scenes": [{"heightmap": ")" + heightmap + R"(", "views": "top"}], "sweeps": [{"technique": "flat"}]})");
    return name;
  }
  /// One line on stderr with these words, this exit code, and no output folder.
  void expect_refused(const std::vector<std::string>& arguments, int exit_code, const std::string& words) const {
    const CommandResult result = run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
  }

  TempFolder folder_;
};

TEST_F(CliTest, every_command_has_help_with_an_example) {
  for (const std::string command : {"sweep", "recommend", "report", "tune", "presets", "export", "view", "tuners",
                                    "compare", "bake", "stress", "claims", "list", "devices"}) {
    const CommandResult result = run({command, "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("reliefbench " + command)) << command << " shows no example";
  }
}

TEST_F(CliTest, bad_usage_exits_2_with_one_line) {
  expect_refused({}, 2, "subcommand");
  expect_refused({"sweep"}, 2, "CONFIG");
  expect_refused({"sweep", kSmoke, "--backend", "metal", "-o", "run"}, 2, "metal");
  expect_refused({"sweep", kSmoke}, 2, "-o");
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
  EXPECT_THAT(result.out, HasSubstr("cone@fbm_32x32/oblique?cone_steps=16"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
  const CommandResult json = run({"sweep", kSmoke, "--backend", "null", "--dry-run", "--json"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("cases").size(), 9U);
}

std::set<std::string> case_ids(const std::filesystem::path& run) {
  std::set<std::string> ids;
  std::istringstream in(file_text(run / "results.jsonl"));
  for (std::string line; std::getline(in, line);)
    EXPECT_TRUE(ids.insert(nlohmann::json::parse(line).at("case")).second);
  return ids;
}

TEST_F(CliTest, killed_at_any_moment_it_ends_with_the_same_cases) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "whole", "--backend", "opengl"}).exit_code, 0);
  for (const int wait_ms : {300, 900, 1500, 2100, 2700, 3300}) {
    const pid_t child = start_reliefbench({"sweep", kSmoke, "-o", "killed", "--backend", "opengl"}, folder_.path());
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    kill(child, SIGKILL);
    wait_for(child, folder_.path());
  }
  const CommandResult last = run({"sweep", kSmoke, "-o", "killed", "--backend", "opengl"});
  EXPECT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(case_ids(folder_ / "killed"), case_ids(folder_ / "whole"));
}

TEST_F(CliTest, recommend_answers_or_says_how_near_it_came) {
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

TEST_F(CliTest, a_run_compares_with_itself_as_the_same) {
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "out", "--backend", "null"}).exit_code, 0);
  const CommandResult same = run({"compare", "out", "out"});
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "flat", "--backend", "null", "--filter", "flat@*"}).exit_code, 0);
  ASSERT_EQ(run({"sweep", kSmoke, "-o", "cone", "--backend", "null", "--filter", "cone@*"}).exit_code, 0);
  EXPECT_EQ(run({"compare", "flat", "cone"}).exit_code, 5);
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
