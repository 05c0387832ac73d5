#include <gmock/gmock.h>

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
  EXPECT_THAT(answer.table[1], ElementsAre("spikes_16x16/top", "paper: x", "ours: a", "2.00"));
  scenes[0].rows[0] = figures(0.6, 0, 8, 8);  // then there is nothing to beat in it
  answer = judge_contest(claim, claim.checks[0], scenes);
  EXPECT_THAT(answer.numbers, HasSubstr("geometric mean of 2 over 3"));
  for (SceneFigures& scene : scenes) scene.rows[0] = figures(0.6, 0, 8, 8);
  EXPECT_EQ(judge_contest(claim, claim.checks[0], scenes).verdict, ClaimVerdict::not_testable);
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
  const char* const kTogether = "'by_factor' goes with 'beaten_by' and either 'of_each', or 'best_of' and 'at_most'";
  EXPECT_THAT(contest_refusal(R"({"says": "s", "metric": "psnr", "of_each": ["*"], "by_factor": 2})"),
              HasSubstr(kTogether));
  EXPECT_THAT(
      contest_refusal(
          R"({"says": "s", "metric": "psnr", "of_each": ["*"], "beaten_by": ["*"], "at_most": 1, "by_factor": 2})"),
      HasSubstr(kTogether));
  EXPECT_THAT(
      contest_refusal(R"({"says": "s", "metric": "psnr", "best_of": ["*"], "beaten_by": ["*"], "by_factor": 2})"),
      HasSubstr(kTogether));
  EXPECT_THAT(contest_refusal(R"({"says": "s", "metric": "psnr", "of_each": ["none*"], "beaten_by": ["*"]})"),
              HasSubstr("no row is labelled 'none*'"));
  EXPECT_THAT(contest_refusal(R"({"says": "s", "metric": "psnr", "of": "ours: a", "at_most": 1})"),
              HasSubstr("expected one view"));
}

}  // namespace
}  // namespace reliefbench
