#include "tuner/decide/recommend.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/hand_made.h"

namespace reliefbench {
namespace {

std::string id(const Record* record) { return record == nullptr ? "none" : record->case_id; }

Answer only_answer(const std::vector<Record>& records, const Question& question) {
  std::vector<Answer> answers = recommend(records, question);
  EXPECT_EQ(answers.size(), 1U);
  return answers.at(0);
}

std::vector<Record> some_records() {
  return {
      make_record({.case_id = "flat", .time_ns = 100, .e_xy_p99 = 20, .technique = "flat"}),
      make_record({.case_id = "parallax", .time_ns = 400, .e_xy_p99 = 0.4, .technique = "parallax"}),
      make_record({.case_id = "relief 8", .time_ns = 200, .e_xy_p99 = 0.9}),
      make_record({.case_id = "relief 16", .time_ns = 300, .e_xy_p99 = 0.3}),
      make_record({.case_id = "relief 32", .time_ns = 500, .e_xy_p99 = 0}),
  };
}

TEST(Recommend, picks_the_fastest_within_the_budget) {
  const std::vector<Record> records = some_records();
  const Answer answer = only_answer(records, {.budgets = {{"e_xy.p99", 0.5}}});
  EXPECT_EQ(id(answer.pick), "relief 16");
  EXPECT_EQ(id(answer.runner_up), "parallax");
  EXPECT_EQ(id(answer.simplest), "parallax");
  EXPECT_EQ(id(answer.flat), "flat");
  EXPECT_EQ(id(answer.nearest), "none");
  EXPECT_EQ(id(answer.just_fails), "relief 8");  // of what is faster, it misses least
}

TEST(Recommend, picks_the_most_accurate_within_a_time) {
  const std::vector<Record> records = some_records();
  const Answer answer = only_answer(records, {.budgets = {}, .max_time_ms = 0.00042});
  EXPECT_EQ(id(answer.pick), "relief 16");
  EXPECT_EQ(id(answer.runner_up), "parallax");
  EXPECT_EQ(id(answer.simplest), "flat");
}

// No relief takes the least time: of a question about time it once was "the simplest", whatever its error.
TEST(Recommend, the_simplest_within_a_time_keeps_to_the_budgets_of_the_run) {
  const std::vector<Record> records = some_records();
  Question question{.budgets = {}, .max_time_ms = 0.00042, .simplest_budgets = {{"e_xy.p99", 0.5}}};
  EXPECT_EQ(id(only_answer(records, question).simplest), "parallax");
  EXPECT_EQ(id(only_answer(records, question).pick), "relief 16");
  question.simplest_budgets = {{"e_xy.p99", 0.1}};
  EXPECT_EQ(id(only_answer(records, question).simplest), "none");
  EXPECT_TRUE(answers_json(recommend(records, question), question).at("answers").at(0).at("simplest").is_null());
}

TEST(Recommend, of_times_that_overlap_the_simpler_and_smaller_is_the_pick_and_the_tie_is_named) {
  std::vector<Record> records = {
      make_record({.case_id = "rg32f", .time_ns = 3010, .params = {{"refinement", "none"}}, .memory_bytes = 256 << 10}),
      make_record({.case_id = "rg8", .time_ns = 2680, .params = {{"refinement", "none"}}, .memory_bytes = 64 << 10})};
  records[1].frame_time->summary.ci_high = 3300;  // a sample that was held up
  const Answer answer = only_answer(records, {});
  EXPECT_EQ(id(answer.pick), "rg8");
  EXPECT_EQ(id(answer.tie), "rg32f");
  EXPECT_EQ(id(answer.runner_up), "rg32f");
  EXPECT_EQ(answer.ties, 1U);
  records[1].memory_bytes = records[0].memory_bytes;
  records[1].params = make_record({.case_id = "", .params = {{"refinement", "binary"}}}).params;
  EXPECT_EQ(id(only_answer(records, {}).pick), "rg32f");  // fewer features
  records[0].frame_time->summary.ci_low = 3000;
  records[1].frame_time->summary.ci_high = 2700;
  EXPECT_EQ(id(only_answer(records, {}).pick), "rg8");
  EXPECT_EQ(id(only_answer(records, {}).tie), "none");
}

// A cone map that takes 900 ns to bake costs a heightmap that changes: in every frame all of it, in every tenth a
// tenth.
TEST(Recommend, a_map_that_is_baked_again_costs_its_frames) {
  const auto picked = [](std::optional<int> rebake_every) {
    std::vector<Record> records = {make_record({.case_id = "relief", .time_ns = 1000}),
                                   make_record({.case_id = "cone", .time_ns = 800, .technique = "cone"})};
    records[1].bake_time_ns = 900;
    records.push_back(records[1]);
    records.back().frame_time.reset();  // not measured
    if (rebake_every) add_bakes(records, *rebake_every);
    const Answer answer = only_answer(records, {});
    return std::pair(id(answer.pick), answer.pick->frame_time->summary.median);
  };
  EXPECT_EQ(picked(std::nullopt), std::pair(std::string("cone"), 800.0));
  EXPECT_EQ(picked(10), std::pair(std::string("cone"), 890.0));
  EXPECT_EQ(picked(1), std::pair(std::string("relief"), 1000.0));
}

// Its own device bakes the map in 90 ns.
TEST(Recommend, a_map_that_its_device_bakes_costs_the_devices_time) {
  std::vector<Record> records = {make_record({.case_id = "relief", .time_ns = 1000}),
                                 make_record({.case_id = "cone", .time_ns = 800, .technique = "cone"})};
  records[1].bake_time_ns = 900;
  records[1].device_bake_ns = 90;
  add_bakes(records, 1);
  const Answer answer = only_answer(records, {});
  EXPECT_EQ(id(answer.pick), "cone");
  EXPECT_EQ(answer.pick->frame_time->summary.median, 890);
  Question question;
  question.rebake_every = 1;
  const nlohmann::json json = answers_json(std::vector{answer}, question);
  EXPECT_EQ(json["answers"][0]["pick"]["device_bake_ns"], 90);
}

TEST(Recommend, counts_the_simpler_settings_that_were_measured) {
  std::vector<Record> records = some_records();
  EXPECT_EQ(only_answer(records, {.budgets = {{"e_xy.p99", 0.35}}}).simpler, 2U);  // flat and parallax
  records.erase(records.begin(), records.begin() + 2);
  EXPECT_EQ(only_answer(records, {.budgets = {{"e_xy.p99", 0.35}}}).simpler, 0U);
}

TEST(Recommend, lets_flat_win_a_loose_budget) {
  const std::vector<Record> records = some_records();
  const Answer answer = only_answer(records, {.budgets = {{"e_xy.p99", 100}}});
  EXPECT_EQ(id(answer.pick), "flat");
  EXPECT_EQ(id(answer.simplest), "flat");
}

TEST(Recommend, judges_by_the_upper_end_of_the_interval) {
  std::vector<Record> records = {make_record({.case_id = "lucky", .time_ns = 100}),
                                 make_record({.case_id = "steady", .time_ns = 110})};
  records[0].frame_time->summary.ci_high = 150;
  EXPECT_EQ(id(only_answer(records, {}).pick), "steady");
  EXPECT_EQ(id(only_answer(records, {.budgets = {}, .max_time_ms = 0.00012}).pick), "steady");
}

TEST(Recommend, breaks_ties_by_error_then_by_case_id) {
  const std::vector<Record> records = {make_record({.case_id = "c", .e_xy_p99 = 0.1}),
                                       make_record({.case_id = "b", .e_xy_p99 = 0}),
                                       make_record({.case_id = "a", .e_xy_p99 = 0})};
  const Answer answer = only_answer(records, {});
  EXPECT_EQ(id(answer.pick), "a");
  EXPECT_EQ(id(answer.runner_up), "b");
}

TEST(Recommend, says_how_near_the_nearest_came) {
  const std::vector<Record> records = {
      make_record({.case_id = "far in one", .time_ns = 900, .e_xy_p99 = 2, .missed_rate = 0}),
      make_record({.case_id = "near in both", .time_ns = 900, .e_xy_p99 = 0.61, .missed_rate = 0.0012})};
  const Question question{.budgets = {{"e_xy.p99", 0.5}, {"missed_rate", 0.001}}};
  const Answer answer = only_answer(records, question);
  EXPECT_EQ(answer.pick, nullptr);
  EXPECT_EQ(id(answer.nearest), "near in both");
  EXPECT_EQ(answer.miss, "e_xy.p99 is 0.61 where 0.5 is asked, missed_rate is 0.0012 where 0.001 is asked");
  EXPECT_EQ(exit_of(std::vector<Answer>{answer}), Exit::answer_is_no);
}

TEST(Recommend, says_how_near_the_nearest_came_to_a_limit_of_zero_and_a_time) {
  const std::vector<Record> records = {make_record({.case_id = "a", .time_ns = 3e6, .e_xy_p99 = 0.1}),
                                       make_record({.case_id = "b", .time_ns = 2e6, .e_xy_p99 = 0.3})};
  const Question question{.budgets = {{"e_xy.p99", 0}}, .max_time_ms = 1};
  const Answer answer = only_answer(records, question);
  EXPECT_EQ(id(answer.nearest), "b");
  EXPECT_EQ(answer.miss, "e_xy.p99 is 0.3 where 0 is asked, frame time is up to 2.02 ms where 1 ms is asked");
}

TEST(Recommend, answers_each_device_and_scene) {
  std::vector<Record> records = {make_record({.case_id = "a", .scene = "rocks/top"}),
                                 make_record({.case_id = "b", .scene = "rocks/grazing"}),
                                 make_record({.case_id = "c", .scene = "rocks/grazing", .backend = "opengl"})};
  records[1].status = Status::unsupported;
  records[1].reason = "no rg16";
  const std::vector<Answer> answers = recommend(records, {});
  ASSERT_EQ(answers.size(), 3U);
  EXPECT_EQ(id(answers[0].pick), "none");
  EXPECT_EQ(id(answers[0].nearest), "none");
  EXPECT_EQ(answers[0].miss, "no case was measured, of 1; the first is unsupported: no rg16");
  EXPECT_EQ(id(answers[1].pick), "a");
  EXPECT_EQ(id(answers[2].pick), "c");
  EXPECT_EQ(exit_of(answers), Exit::answer_is_no);
  EXPECT_EQ(exit_of(std::vector<Answer>{answers[0]}), Exit::nothing_measured);
  EXPECT_EQ(exit_of(std::vector<Answer>{answers[1], answers[2]}), Exit::done);
  EXPECT_EQ(exit_of(std::vector<Answer>{}), Exit::nothing_measured);
}

TEST(Recommend, takes_a_metric_where_higher_is_better) {
  std::vector<Record> records = {make_record({.case_id = "identical"}), make_record({.case_id = "good"}),
                                 make_record({.case_id = "poor"})};
  (*records[1].error)["psnr"] = 50;
  (*records[2].error)["psnr"] = 20;
  const Answer answer = only_answer(records, {.budgets = {{"psnr", 30}}, .max_time_ms = 1, .error_metric = "psnr"});
  EXPECT_EQ(id(answer.pick), "identical");
  EXPECT_EQ(id(answer.runner_up), "good");
}

TEST(Recommend, refuses_an_unknown_metric) {
  EXPECT_THROW((void)recommend({}, {.budgets = {{"no_such", 1}}}), Error);
  EXPECT_THROW((void)recommend({}, {.budgets = {}, .error_metric = "no_such"}), Error);
}

TEST(Recommend, is_written_with_the_question_and_whole_records) {
  const std::vector<Record> records = some_records();
  const Question question{.budgets = {{"e_xy.p99", 0.5}}};
  const nlohmann::json json = answers_json(recommend(records, question), question);
  EXPECT_EQ(json.at("question").at("budgets"), nlohmann::json({"e_xy.p99<=0.5"}));
  EXPECT_TRUE(json.at("question").at("max_time_ms").is_null());
  EXPECT_EQ(json.at("answers").at(0).at("pick").at("case"), "relief 16");
  EXPECT_TRUE(json.at("answers").at(0).at("nearest").is_null());
  EXPECT_TRUE(json.at("answers").at(0).at("tie").is_null());
  EXPECT_NEAR(json.at("answers").at(0).at("pick").at("frame_time_ns").at("coverage").get<double>(), 1 - 2.0 / 128,
              1e-12);
}

}  // namespace
}  // namespace reliefbench
