// `compare` from the command line, on runs of the null backend whose change is known.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/command.h"
#include "tests/hand_made.h"
#include "tests/schema.h"
#include "tests/synthetic_run.h"
#include "tests/temp_folder.h"
#include "tuner/decide/compare_text.h"
#include "tuner/decide/markup.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

std::string config_text(int seed, int samples) {
  return fmt::format(R"({{"name": "power", "seed": {},
    "scenes": [{{"heightmap": {{"source": "fbm", "width": 32, "height": 32}}, "views": "oblique",
                 "frame_px": [32, 32]}}],
    "measure": {{"samples": {}, "batch_ms": 0.5, "warmup_batches_max": 2, "control_every": 4, "block_cases": 32}},
    "sweeps": [
      {{"technique": "flat"}},
      {{"technique": "relief", "axes": {{"linear_steps": [8, 16, 32], "refinement": ["none", "secant"]}}}},
      {{"technique": "cone", "axes": {{"cone_steps": [8, 16, 32], "format": ["rg8", "rg16"]}}}},
      {{"technique": "relaxed_cone", "axes": {{"cone_steps": [8, 15, 32], "refinement": ["secant", "binary"]}}}}]}})",
                     seed, samples);
}

class CompareCliTest : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments) const {
    return run_reliefbench(arguments, folder_.path());
  }
  void sweep(const std::string& output, int seed, const std::string& slowdown = "", int samples = 10) const {
    std::ofstream(folder_ / "config.json") << config_text(seed, samples);
    std::vector<std::string> arguments = {"sweep", "config.json", "--backend",  "null", "--quiet",
                                          "-o",    output,        "--pictures", "none"};
    if (!slowdown.empty()) arguments.insert(arguments.end(), {"--inject-slowdown", slowdown});
    const CommandResult result = run(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  /// Which groups and cases are called slower or faster.
  [[nodiscard]] static std::vector<std::string> called(const json& comparison) {
    std::vector<std::string> names;
    for (const char* list : {"groups", "cases"})
      for (const json& one : comparison.at(list))
        if (one.at("change") == "slower" || one.at("change") == "faster")
          names.push_back(one.at(list == std::string("groups") ? "group" : "case"));
    return names;
  }

  TempFolder folder_;
};

TEST_F(CompareCliTest, a_slower_technique_is_found_and_nothing_else) {
  sweep("base", 1);
  for (const char* slowdown : {"", "relaxed_cone:1.05", "relaxed_cone:1.1"}) {
    const std::string output = fmt::format("new{}", slowdown);
    sweep(output, 2, slowdown);
    const CommandResult result = run({"compare", "base", output, "--json", "--junit", "out.xml"});
    const bool is_slowed = *slowdown != '\0';
    EXPECT_EQ(result.exit_code, is_slowed ? 1 : 0) << slowdown << result.out;
    const json comparison = json::parse(result.out);
    EXPECT_EQ(comparison.at("verdict"), is_slowed ? "slower" : "same");
    if (is_slowed) {
      EXPECT_THAT(called(comparison), testing::Contains("null technique=relaxed_cone"));
    }
    EXPECT_THAT(called(comparison), Each(testing::AnyOf(HasSubstr("relaxed"), testing::Eq("all"))));
    EXPECT_EQ(output_of(fmt::format("xmllint --xpath 'count(//failure) > 0' '{}'", (folder_ / "out.xml").string())),
              is_slowed ? "true\n" : "false\n");
  }
}

TEST_F(CompareCliTest, what_is_in_doubt_is_measured_again_in_turns) {
  sweep("base", 1, "", 2);
  sweep("new", 2, "", 2);
  // A threshold below the null device's noise leaves everything in doubt.
  const CommandResult doubt = run({"compare", "base", "new", "--threshold", "0.0002"});
  EXPECT_EQ(doubt.exit_code, 4) << doubt.out << doubt.err;
  EXPECT_THAT(doubt.out, AllOf(HasSubstr("in doubt: "), HasSubstr("reliefbench compare base new --rerun")));
  const auto rerun = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"compare", "base",   "new",           "--threshold", "0.0002",   "--rerun",
                                          "--quiet", "--json", "--rerun-cases", "40",          "--rounds", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  const CommandResult same = rerun({});
  const json of_same = json::parse(same.out);
  EXPECT_GT(of_same.at("rerun").at("cases"), 5);
  EXPECT_EQ(of_same.at("rerun").at("same_build"), true);
  for (const json& one : of_same.at("cases")) EXPECT_NE(one.at("change"), "slower") << one;
  EXPECT_TRUE(std::filesystem::exists(of_same.at("rerun").at("folder").get<std::string>() + "/08-a/run.json"));

  // Two builds, one of which is slower.
  const std::filesystem::path slow = folder_ / "slow";
  std::ofstream(slow) << fmt::format("#!/bin/sh\nexec {} \"$@\" --inject-slowdown relaxed_cone:1.2\n",
                                     RELIEFBENCH_BINARY);
  std::filesystem::permissions(slow, std::filesystem::perms::owner_all);
  const CommandResult slower = rerun({"--binary-a", RELIEFBENCH_BINARY, "--binary-b", slow.string()});
  EXPECT_EQ(slower.exit_code, 1) << slower.err;
  // What was in doubt of the relaxed cones, as cases or as one, is slower by what the second build is.
  int found = 0;
  const json comparison = json::parse(slower.out);
  for (const char* list : {"groups", "cases"})
    for (const json& one : comparison.at(list)) {
      const std::string name = one.at(list == std::string("groups") ? "group" : "case");
      if (one.at("reason") != "remeasured" || name.find("relaxed_cone") == std::string::npos) continue;
      EXPECT_EQ(one.at("change"), "slower") << name;
      EXPECT_NEAR(one.at("ratio").get<double>(), 1.2, 0.02) << name;
      ++found;
    }
  EXPECT_GE(found, 1);
}

TEST_F(CompareCliTest, builds_that_differ_need_both_binaries) {
  sweep("base", 1);
  std::filesystem::copy(folder_ / "base", folder_ / "new", std::filesystem::copy_options::recursive);
  json info = json::parse(file_text(folder_ / "new/run.json"));
  info["git_sha"] = "another";
  info["host"]["kernel"] = "<hostile> & \"|`";
  std::ofstream(folder_ / "new/run.json") << info.dump();
  CommandResult result = run({"compare", "base", "new", "--rerun"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--rerun needs --binary-a and --binary-b"));
  result = run({"compare", "base", "new"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("git sha"), HasSubstr("another")));
  result = run({"compare", "base", "new", "--markdown"});
  EXPECT_THAT(result.out, AllOf(HasSubstr("| same | same_measurement |"), HasSubstr("\\<hostile\\>")));
}

TEST_F(CompareCliTest, another_driver_is_named_where_that_is_asked) {
  sweep("base", 1);
  sweep("new", 2, "relaxed_cone:1.1");
  json info = json::parse(file_text(folder_ / "new/run.json"));
  info["identity"]["devices"][0]["driver"] = "2.0";
  info["devices"][0]["driver"] = "2.0";
  std::ofstream(folder_ / "new/run.json") << info.dump();
  CommandResult result = run({"compare", "base", "new"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("different drivers on null"), HasSubstr("--across-drivers")));
  result = run({"compare", "base", "new", "--across-drivers", "--json"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const json comparison = json::parse(result.out);
  EXPECT_THAT(comparison.at("drivers").at(0).get<std::string>(), HasSubstr("now 2.0"));
  for (const json& group : comparison.at("groups"))
    EXPECT_EQ(group.at("change") == "slower", group.at("reason") == "different_driver") << group;
}

TEST_F(CompareCliTest, a_text_fits_the_line) {
  sweep("base", 1);
  sweep("new", 2, "relaxed_cone:1.1");
  const CommandResult result = run({"compare", "base", "new", "--all"});
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;
}

TEST(CompareText, junit_is_well_formed_whatever_names_hold) {
  Comparison comparison;
  const std::string hostile = std::string(kHostileText) + " \x01 \xff \xed\xa0\x80 \xef\xbf\xbe é";
  comparison.matched = 1;
  comparison.cases.push_back({TimeChange{.ratio = {.ratio = 1.2, .low = 1.1, .high = 1.3},
                                         .p = 0.01,
                                         .change = Change::slower,
                                         .reason = Reason::beyond_chance},
                              hostile});
  comparison.lost.push_back(hostile);
  const TempFolder folder;
  std::ofstream(folder / "out.xml") << compare_junit(comparison);
  const std::string file = "'" + (folder / "out.xml").string() + "'";
  EXPECT_EQ(std::system(("xmllint --noout " + file).c_str()), 0);
  EXPECT_EQ(output_of("xmllint --xpath 'string(//testsuite/@failures)' " + file), "2\n");
  EXPECT_THAT(output_of("xmllint --xpath 'string(//testcase/@name)' " + file),
              HasSubstr("</script><script>alert(\"x\")"));
}

}  // namespace
}  // namespace reliefbench
