#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/measure/claims.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string contest_text(const std::string& check) {
  return R"({"source": "s", "about": "a",
"scenes": [{"heightmap": {"source": "spikes", "width": 16, "height": 16}, "views": ["top", "oblique"]},
           {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "top"}],
"metrics": ["e_xy.p99"],
"rows": [{"label": "paper: x", "settings": "relief?linear_steps=8"},
         {"label": "ours: a", "settings": "cone?cone_steps=8"}, {"label": "ours: b", "settings": "cone?cone_steps=9"}],
"checks": [)" +
         check + "]}";
}

constexpr const char* kEach = R"({"says": "s", "metric": "e_xy.p99", "of_each": ["paper: *"], "beaten_by": ["ours: *"],
"by_factor": 1.5})";
constexpr const char* kBest = R"({"says": "s", "metric": "e_xy.p99", "at_most": 0.5, "best_of": ["paper: x"],
"beaten_by": ["*"], "by_factor": 1.5})";

Claim contest(const char* check) { return parse_claim(contest_text(check), "x.json"); }

ClaimFigures figures(double error, double missed, double choosing_ns, double told_ns) {
  ClaimFigures result{.values = {{"e_xy.p99", error}, {"missed_rate", missed}}};
  for (int round = 0; round < 18; ++round) result.times_ns.push_back(round % 2 == 0 ? choosing_ns : told_ns);
  return result;
}

std::vector<SceneFigures> in_all_scenes(const Claim& claim, const std::vector<ClaimFigures>& rows) {
  std::vector<SceneFigures> scenes;
  for (const SceneSpec& scene : claim.scenes) scenes.push_back({.scene = &scene, .rows = rows});
  return scenes;
}

TEST(Contests, are_over_all_scenes) {
  const Claim claim = contest(kEach);
  ASSERT_EQ(claim.scenes.size(), 3U);
  EXPECT_THAT(claim.checks[0].beaten_by, ElementsAre("ours: a", "ours: b"));
  std::vector<SceneFigures> scenes =
      in_all_scenes(claim, {figures(1, 0.1, 8, 8), figures(1, 0.1, 4, 4), figures(2, 0, 1, 1)});
  scenes[2].rows[1] = figures(1, 0.1, 1, 1);
  const ClaimAnswer answer = judge_contest(claim, claim.checks[0], scenes);
  EXPECT_EQ(answer.verdict, ClaimVerdict::reproduced);  // 2, 2 and 8: the cube root of 32
  EXPECT_THAT(answer.numbers, StartsWith("3.17 [3.17, 3.17; 96.1 %] times as fast, geometric mean of 3 over 3 scenes, "
                                         "each 2.00 to 8.00; 1.5 was asked: reached"));
  EXPECT_THAT(answer.table, ElementsAre(ElementsAre("times as fast", "spikes_16x16", "fbm_16x16", "all"),
                                        ElementsAre("paper: x", "2.00", "8.00", "3.17")));
}

// A mean over views has several winners: each scene tells its own, with an interval.
TEST(Contests, tell_each_scenes_winner_and_interval) {
  const Claim claim = contest(kEach);
  std::vector<SceneFigures> scenes =
      in_all_scenes(claim, {figures(1, 0.1, 8, 8), figures(1, 0.1, 4, 4), figures(2, 0, 1, 1)});
  scenes[1].rows[2] = figures(0.5, 0, 1, 1);
  scenes[1].rows[2].times_ns[1] = 2;
  ClaimResult result{.claim = &claim, .scenes = scenes, .answers = {judge_contest(claim, claim.checks[0], scenes)}};
  const nlohmann::json duels = claims_json({&result, 1})[0]["checks"][0]["duels"];
  ASSERT_EQ(duels.size(), 3U);
  EXPECT_EQ(duels[0]["by"], "ours: a");
  EXPECT_EQ(duels[1]["scene"], "spikes_16x16/oblique");
  EXPECT_EQ(duels[1]["of"], "paper: x");
  EXPECT_EQ(duels[1]["by"], "ours: b");
  EXPECT_EQ(duels[1]["times_as_fast"]["median"], 8);
  EXPECT_EQ(duels[1]["times_as_fast"]["ci_high"], 8);
  EXPECT_EQ(duels[1]["times_as_fast"]["n"], 9);
}

TEST(Contests, let_in_nothing_less_accurate_and_nothing_is_slower_than_itself) {
  const Claim claim = contest(kEach);
  // One misses more, one errs more.
  const ClaimAnswer answer =
      judge_contest(claim, claim.checks[0],
                    in_all_scenes(claim, {figures(1, 0.1, 8, 8), figures(1, 0.2, 1, 1), figures(1.1, 0.1, 1, 1)}));
  EXPECT_EQ(answer.verdict, ClaimVerdict::not_reproduced);
  EXPECT_THAT(answer.numbers, StartsWith("1.00 [1.00, 1.00;"));
  EXPECT_THAT(answer.numbers, HasSubstr("not reached"));
}

// What was fastest by chance while it was chosen is told as fast as it then is.
TEST(Contests, choose_by_other_rounds_than_they_tell) {
  const Claim claim = contest(kEach);
  const ClaimAnswer answer =
      judge_contest(claim, claim.checks[0],
                    in_all_scenes(claim, {figures(1, 0.1, 8, 8), figures(1, 0.1, 2, 10), figures(1, 0.1, 4, 4)}));
  EXPECT_THAT(answer.numbers, StartsWith("0.80 [0.80, 0.80;"));
}

TEST(Contests, compare_the_best_within_a_bound) {
  const Claim claim = contest(kBest);
  std::vector<SceneFigures> scenes =
      in_all_scenes(claim, {figures(0.5, 0, 8, 8), figures(0.4, 0, 4, 4), figures(0.6, 0, 1, 1)});
  ClaimAnswer answer = judge_contest(claim, claim.checks[0], scenes);
  EXPECT_THAT(answer.numbers, StartsWith("2.00 [2.00, 2.00; 96.1 %] times as fast, geometric mean of 3 over 3"));
  ASSERT_EQ(answer.duels.size(), 3U);
  EXPECT_EQ(answer.duels[0].scene, "spikes_16x16/top");
  EXPECT_EQ(answer.duels[0].of, "paper: x");
  EXPECT_EQ(answer.duels[0].by, "ours: a");
  EXPECT_EQ(answer.duels[0].times_as_fast.median, 2);
  scenes[0].rows[0] = figures(0.6, 0, 8, 8);  // then there is nothing to beat in it
  answer = judge_contest(claim, claim.checks[0], scenes);
  EXPECT_THAT(answer.numbers, HasSubstr("geometric mean of 2 over 3"));
  for (SceneFigures& scene : scenes) scene.rows[0] = figures(0.6, 0, 8, 8);
  EXPECT_EQ(judge_contest(claim, claim.checks[0], scenes).verdict, ClaimVerdict::not_testable);
}

constexpr const char* kOne = R"({"says": "{} is beaten", "metric": "e_xy.p99", "of_each": ["paper: *"],
"beaten_by": ["*"]})";

TEST(Contests, hold_what_is_tuned_against_a_setting) {
  const Claim claim = contest(kOne);
  ASSERT_EQ(claim.checks.size(), 1U);
  EXPECT_EQ(claim.checks[0].says, "paper: x is beaten");
  EXPECT_EQ(claim.checks[0].of, "paper: x");
  const auto judged_with = [&](const ClaimFigures& a, const ClaimFigures& b, double b_errs_once) {
    std::vector<SceneFigures> scenes = in_all_scenes(claim, {figures(1, 0.1, 8, 8), a, b});
    scenes[2].rows[2].values["e_xy.p99"] = b_errs_once;
    return judge_contest(claim, claim.checks[0], scenes);
  };
  const ClaimAnswer beaten = judged_with(figures(0.5, 0, 4, 4), figures(1, 0.1, 2, 2), 1.1);
  EXPECT_EQ(beaten.verdict, ClaimVerdict::reproduced);  // 4, 4 and 2: the cube root of 32
  EXPECT_EQ(beaten.numbers,
            "paper: x (e_xy.p99 1 to 1, 0.1000 missed at most, in 3 scenes) is beaten: the fastest in each scene that "
            "is no less accurate there is 3.17 [3.17, 3.17; 96.1 %] times as fast ('ours: a' in 1, 'ours: b' in 2); "
            "one setting for all of them: 'ours: a' (e_xy.p99 0.5 to 0.5, 0.0000 missed at most), 2.00 [2.00, 2.00; "
            "96.1 %] times.");
  EXPECT_EQ(beaten.duels.size(), 3U);
  EXPECT_EQ(beaten.duels[0].by, "ours: b");
  // Chosen by other rounds than those that are told.
  EXPECT_THAT(judged_with(figures(1, 0.1, 2, 10), figures(1, 0.1, 4, 4), 1).numbers,
              HasSubstr("is not beaten: the fastest in each scene that is no less accurate there is 0.80 [0.80,"));
  // One with the same settings, which it is itself here, is no other.
  const ClaimAnswer alone = judged_with(figures(1, 0.2, 1, 1), figures(1.1, 0.1, 1, 1), 1.1);
  EXPECT_EQ(alone.verdict, ClaimVerdict::not_reproduced);
  EXPECT_THAT(alone.numbers, HasSubstr("is 1.00 [1.00, 1.00; 96.1 %] times as fast (itself in 3); one setting for all "
                                       "of them: none of 2 others is as accurate in all of them."));
}

constexpr const char* kGroups = R"({"says": "s", "metric": "e_xy.p99", "of_each": ["paper: *", "engine"],
"beaten_by": ["ours: *"], "rather_than": ["linear: *"]})";

TEST(Contests, hold_groups_of_settings_against_the_same) {
  std::string text = contest_text(kGroups);
  const std::string more = R"(, {"label": "engine", "settings": "relief?linear_steps=10"},
{"label": "linear: c", "settings": "relief?linear_steps=11"}],)";
  const std::size_t end = text.find("],\n\"checks\"");
  text.replace(end, 2, more);
  const Claim claim = parse_claim(text, "x.json");
  // paper: x, ours: a, ours: b, engine, linear: c
  const auto judged_with = [&](double ours_ns, double linear_ns, double linear_error) {
    return judge_contest(
        claim, claim.checks[0],
        in_all_scenes(claim, {figures(1, 0.1, 8, 8), figures(1, 0.1, ours_ns, ours_ns), figures(2, 0, 1, 1),
                              figures(3, 0.1, 0.6, 0.6), figures(linear_error, 0.1, linear_ns, linear_ns)}));
  };
  const ClaimAnswer win = judged_with(2, 4, 1);
  EXPECT_EQ(win.verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(
      win.numbers,
      "The fastest that is no less accurate, of 2 in 3 scenes: ours 3 times, linear 0 times, itself 3 times. Where "
      "both are as accurate, ours are 2.83 [2.83, 2.83; 96.1 %] times as fast as linear, geometric mean of 6 "
      "(oblique 2.83 [2.83, 2.83], top 2.83 [2.83, 2.83]): ours win.");
  EXPECT_THAT(win.table[1],
              ElementsAre("paper: x", "4.00 [4.00, 4.00]", "2.00 [2.00, 2.00]", "2.00 [2.00, 2.00]", "3, 0, 0"));
  EXPECT_THAT(win.table[2],
              ElementsAre("engine", "0.60 [0.60, 0.60]", "0.15 [0.15, 0.15]", "4.00 [4.00, 4.00]", "0, 0, 3"));
  EXPECT_EQ(win.duels.size(), 6U);
  const ClaimAnswer loss = judged_with(4, 0.25, 1);
  EXPECT_EQ(loss.verdict, ClaimVerdict::not_reproduced);
  EXPECT_THAT(loss.numbers, HasSubstr("ours 0 times, linear 6 times, itself 0 times"));
  EXPECT_THAT(loss.numbers, HasSubstr("ours lose."));
  const ClaimAnswer alone = judged_with(4, 2, 3.5);
  EXPECT_EQ(alone.verdict, ClaimVerdict::not_testable);
  EXPECT_THAT(alone.numbers, HasSubstr("ours 3 times, linear 0 times, itself 3 times."));
  EXPECT_THAT(alone.table[1], ElementsAre("paper: x", "2.00 [2.00, 2.00]", "-", "-", "3, 0, 0"));
}

std::string contest_refusal(const char* check) {
  try {
    (void)contest(check);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(Contests, refusals_say_what_goes_together) {
  const char* const kTogether = "'beaten_by' goes with 'of'; or with 'of_each', and 'rather_than' or 'by_factor'; or";
  EXPECT_THAT(contest_refusal(R"({"says": "s", "metric": "psnr", "of_each": ["*"], "by_factor": 2})"),
              HasSubstr(kTogether));
  EXPECT_THAT(
      contest_refusal(
          R"({"says": "s", "metric": "psnr", "of_each": ["*"], "beaten_by": ["*"], "at_most": 1, "by_factor": 2})"),
      HasSubstr(kTogether));
  EXPECT_THAT(
      contest_refusal(R"({"says": "s", "metric": "psnr", "best_of": ["*"], "beaten_by": ["*"], "by_factor": 2})"),
      HasSubstr(kTogether));
  for (const char* rest : {R"("of_each": ["*"])", R"("of": "ours: a", "of_each": ["*"], "beaten_by": ["*"])",
                           R"("of": "ours: a", "beaten_by": ["*"], "rather_than": ["*"])",
                           R"("of": "ours: a", "beaten_by": ["*"], "at_most": 1)",
                           R"("of": "ours: a", "beaten_by": ["*"], "by_factor": 2)",
                           R"("of_each": ["*"], "beaten_by": ["*"], "rather_than": ["*"], "by_factor": 2)"})
    EXPECT_THAT(contest_refusal(fmt::format(R"({{"says": "s", "metric": "psnr", {}}})", rest).c_str()),
                HasSubstr(kTogether))
        << rest;
  EXPECT_THAT(contest_refusal(R"({"says": "s", "metric": "psnr", "of_each": ["none*"], "beaten_by": ["*"]})"),
              HasSubstr("no row is labelled 'none*'"));
}

}  // namespace
}  // namespace reliefbench
