#include "tuner/plan/plan.h"

#include <fnmatch.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

const std::vector<std::string> kBoth{"opengl", "vulkan"};
const std::vector<std::string> kOne{"null"};

/// sweeps: the text of the list, which begins on line 2
Config config_of(std::string_view sweeps, std::string_view views = R"("top")") {
  return parse_config(
      fmt::format("{{\"scenes\": {{\"heightmap\": \"rocks\", \"views\": {}}}, \"sweeps\": [\n{}\n]}}", views, sweeps),
      "c.json");
}

std::vector<std::string> case_ids(const Plan& plan) {
  std::vector<std::string> list;
  for (const Case& c : plan.cases) list.push_back(c.id());
  return list;
}

std::vector<std::string> setting_texts(std::string_view sweep) {
  std::vector<std::string> list;
  for (const Case& c : make_plan(config_of(sweep), kOne, "").cases) list.push_back(c.settings.text());
  return list;
}

TEST(Plan, CaseIdSpellsOutTheDefaults) {
  const Plan plan = make_plan(config_of(R"({"technique": "relief"}, {"technique": "flat"})"), kOne, "");
  EXPECT_THAT(case_ids(plan), testing::UnorderedElementsAre(
                                  "relief@rocks/top?linear_steps=16&refinement=binary&binary_steps=5&loop=early_exit&"
                                  "format=r8&filter=hardware&backend=null",
                                  "flat@rocks/top?backend=null"));
}

TEST(Plan, ProductAndZip) {
  EXPECT_THAT(setting_texts(R"({"technique": "parallax", "axes": {"variant": ["plain", "offset_limited"],
                              "filter": ["hardware", "manual"]}})"),
              ElementsAre("variant=plain&format=r8&filter=hardware", "variant=plain&format=r8&filter=manual",
                          "variant=offset_limited&format=r8&filter=hardware",
                          "variant=offset_limited&format=r8&filter=manual"));
  EXPECT_THAT(
      setting_texts(R"({"technique": "parallax", "combine": "zip", "axes": {
                              "variant": ["plain", "offset_limited"], "filter": ["hardware", "manual"],
                              "format": "r16"}})"),
      ElementsAre("variant=plain&format=r16&filter=hardware", "variant=offset_limited&format=r16&filter=manual"));
}

TEST(Plan, LinkedAxesMoveTogether) {
  const auto list = setting_texts(R"({"technique": "relief", "axes": {"format": ["r8", "r16"],
                                    "linear_steps,binary_steps": [[16, 5], [32, 6]]}})");
  ASSERT_EQ(list.size(), 4U);
  for (const std::string& text : list)
    EXPECT_EQ(text.find("linear_steps=16") == std::string::npos, text.find("binary_steps=6") != std::string::npos);
}

TEST(Plan, InactiveParametersMakeNoDuplicates) {
  EXPECT_EQ(setting_texts(R"({"technique": "relief", "axes": {"refinement": ["none", "binary"],
                            "binary_steps": [4, 5, 6]}})")
                .size(),
            4U);
  // The same case from two sweeps, or from a value that stands twice, is one case.
  EXPECT_EQ(
      setting_texts(R"({"technique": "relief", "axes": {"linear_steps": [16, 16]}}, {"technique": "relief"})").size(),
      1U);
}

TEST(Plan, WhereLeavesOut) {
  const auto list =
      setting_texts(R"({"technique": "relief", "axes": {"format": ["r8", "r16"], "filter": ["hardware", "manual"]},
                                    "where": [{"if": {"format": ["r8"]}, "then": {"filter": ["hardware"]}}]})");
  EXPECT_EQ(list.size(), 3U);
  // An inactive parameter never makes an `if` true, and never breaks a `then`.
  EXPECT_EQ(setting_texts(R"({"technique": "relief", "axes": {"refinement": ["none", "binary"], "binary_steps": [4, 5]},
                            "where": [{"if": {"binary_steps": 5}, "then": {"refinement": "none"}},
                                      {"if": {"refinement": "none"}, "then": {"binary_steps": 9}}]})"),
            (std::vector<std::string>{
                "linear_steps=16&refinement=none&loop=early_exit&format=r8&filter=hardware",
                "linear_steps=16&refinement=binary&binary_steps=4&loop=early_exit&format=r8&filter=hardware"}));
}

TEST(Plan, ConflictsAreCountedOncePerSettings) {
  const Plan plan = make_plan(
      config_of(R"({"technique": "cone", "axes": {"format": ["r8", "rg8", "rg16"]}})", R"(["top", "oblique"])"), kBoth,
      "");
  EXPECT_EQ(plan.cases.size(), 8U);
  ASSERT_EQ(plan.conflicts.size(), 1U);
  EXPECT_THAT(plan.conflicts[0],
              AllOf(StartsWith("cone?"), HasSubstr("format=r8"), HasSubstr(": format r8 has room for 0")));
}

TEST(Plan, ASweepWithNothingLeftIsAnErrorWithItsLine) {
  EXPECT_THAT(
      [] {
        return make_plan(
            config_of("{\"technique\": \"flat\"},\n{\"technique\": \"cone\", \"axes\": {\"format\": \"r8\"}}"), kOne,
            "");
      },
      ThrowsMessage<Error>(AllOf(StartsWith("c.json:3: the sweep of 'cone'"), HasSubstr("format r8 has room for 0"))));
  EXPECT_THAT(
      [] {
        return make_plan(config_of(R"({"technique": "relief", "where": {"if": {}, "then": {"format": "r16"}}})"), kOne,
                         "");
      },
      ThrowsMessage<Error>(AllOf(StartsWith("c.json:2: "), HasSubstr("1 by 'where'"))));
}

TEST(Plan, AnEndlessSweepIsAnError) {
  EXPECT_THAT(
      [] {
        return make_plan(config_of(R"({"technique": "relief", "axes": {
                     "linear_steps": {"from": 1, "to": 4096, "step": 1}, "binary_steps": {"from": 1, "to": 32, "step": 1},
                     "secant_steps": {"from": 1, "to": 32, "step": 1}}})"),
                         kOne, "");
      },
      ThrowsMessage<Error>(HasSubstr("over 1000000 combinations")));
}

// The limit is the plan's: neither many sweeps nor many scenes get round it.
TEST(Plan, ManySweepsOrScenesAreNoWayRoundTheLimit) {
  const std::string sweep = R"({"technique": "relief", "axes": {
      "linear_steps": {"from": 1, "to": 500, "step": 1}, "binary_steps": {"from": 1, "to": 32, "step": 1},
      "refinement": "binary"}})";
  std::string sweeps = sweep;
  for (int i = 1; i < 63; ++i) sweeps += ", " + sweep;  // of 16,000 combinations each
  EXPECT_THAT([&] { return make_plan(config_of(sweeps), kOne, ""); },
              ThrowsMessage<Error>(HasSubstr("the plan has over 1000000 combinations")));
  std::string views;
  for (int i = 0; i < 40; ++i)
    views += fmt::format(R"({}{{"id": "view{}", "elevation_deg": {}}})", i == 0 ? "" : ", ", i, 20 + i);
  EXPECT_THAT([&] { return make_plan(config_of(sweep, "[" + views + "]"), kBoth, ""); },
              ThrowsMessage<Error>(HasSubstr("the plan has over 1000000 cases: 16000 settings on 40 scenes")));
}

TEST(Plan, FilterSelects) {
  const Config config = config_of(
      R"({"technique": "relief", "axes": {"linear_steps": [8, 16]}}, {"technique": "flat"})", R"(["top", "oblique"])");
  EXPECT_EQ(make_plan(config, kBoth, "").cases.size(), 12U);
  EXPECT_EQ(make_plan(config, kBoth, "relief@*/top?*backend=vulkan").cases.size(), 2U);
  EXPECT_EQ(make_plan(config, kBoth, "*linear_steps=8&*").cases.size(), 4U);
  EXPECT_THAT(
      [&] { return make_plan(config, kBoth, "reilef*"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("filter 'reilef*' matches none of the 12 cases"), HasSubstr("relief@"))));
  EXPECT_THROW((void)make_plan(config, {}, ""), Error);
}

TEST(Plan, SortedSoThatABakeServesItsCases) {
  const Config config = config_of(
      R"({"technique": "cone", "axes": {"cone_steps": [8, 16], "correction": ["none", "safe"], "format": ["rg8", "rg16"],
                                        "encoding": ["ratio", "sqrt"]}},
         {"technique": "relief", "axes": {"linear_steps": [16, 8]}})",
      R"(["top", "oblique"])");
  const Plan plan = make_plan(config, kBoth, "");
  ASSERT_EQ(plan.cases.size(), 72U);
  // backend, scene and bake each stand in one block
  std::set<std::tuple<std::string, std::string, std::string>> seen;
  std::tuple<std::string, std::string, std::string> last;
  for (const Case& c : plan.cases) {
    const auto scene = std::ranges::find(config.scenes, c.scene_id, &SceneSpec::id);
    const std::tuple now{c.backend, c.scene_id, bake_text(c.settings, *scene)};
    EXPECT_TRUE(now == last || seen.insert(now).second);
    last = now;
  }
  EXPECT_EQ(plan.cases.front().backend, "opengl");
  EXPECT_EQ(plan.cases.front().scene_id, "rocks/top");
  // cone: 2 corrections x 2 height types, encodings share; relief: 1. Views and backends share all.
  EXPECT_THAT(plan.bakes, testing::UnorderedElementsAre(HasSubstr("|height|heights=unorm8|wrap=repeat"),
                                                        HasSubstr("correction=none|max_ratio=1|heights=unorm8"),
                                                        HasSubstr("correction=none|max_ratio=1|heights=unorm16"),
                                                        HasSubstr("correction=safe|max_ratio=1|heights=unorm8"),
                                                        HasSubstr("correction=safe|max_ratio=1|heights=unorm16")));
  EXPECT_TRUE(std::ranges::all_of(plan.bakes, [](const auto& b) { return b.starts_with("rocks|"); }));
}

TEST(Plan, BakeTextTellsWrapsApart) {
  Config config = config_of(R"({"technique": "relaxed_cone", "axes": {"search_steps": 64}})");
  const Case c = make_plan(config, kOne, "").cases.at(0);
  EXPECT_THAT(bake_text(c.settings, config.scenes[0]),
              AllOf(HasSubstr("|search_steps=64|"), testing::EndsWith("|wrap=repeat")));
  config.scenes[0].scene.wrap = Wrap::clamp;
  EXPECT_THAT(bake_text(c.settings, config.scenes[0]), testing::EndsWith("|wrap=clamp"));
}

TEST(Glob, ByHand) {
  EXPECT_TRUE(glob_matches("", ""));
  EXPECT_TRUE(glob_matches("*", ""));
  EXPECT_TRUE(glob_matches("a*b*c", "a--b-b--c"));
  EXPECT_TRUE(glob_matches("a?c", "a?c"));
  EXPECT_FALSE(glob_matches("a?c", "ac"));
  EXPECT_FALSE(glob_matches("a*b", "a--b-"));
  EXPECT_FALSE(glob_matches("", "a"));
  EXPECT_FALSE(glob_matches(std::string(50, '*') + "b", std::string(100000, 'a')));  // and this ends soon
}

RC_GTEST_PROP(Glob, AgreesWithTheShells, ()) {
  const auto pattern = *rc::gen::resize(7, rc::gen::container<std::string>(rc::gen::element('a', 'b', '*', '?')));
  const auto text = *rc::gen::resize(12, rc::gen::container<std::string>(rc::gen::element('a', 'b')));
  RC_ASSERT(glob_matches(pattern, text) == (fnmatch(pattern.c_str(), text.c_str(), 0) == 0));
}

}  // namespace
}  // namespace reliefbench
