#include "tuner/decide/pareto.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tests/hand_made.h"

namespace reliefbench {
namespace {

using Indices = std::vector<std::size_t>;

bool dominates(double time_a, double error_a, double time_b, double error_b) {
  return time_a <= time_b && error_a <= error_b && (time_a < time_b || error_a < error_b);
}

/// The definition, pair by pair.
Indices brute_force(const std::vector<double>& time, const std::vector<double>& error) {
  Indices front;
  for (std::size_t i = 0; i < time.size(); ++i) {
    bool stays = true;
    for (std::size_t j = 0; j < time.size(); ++j) {
      const bool earlier_twin = j < i && time[j] == time[i] && error[j] == error[i];
      if (earlier_twin || dominates(time[j], error[j], time[i], error[i])) stays = false;
    }
    if (stays) front.push_back(i);
  }
  std::sort(front.begin(), front.end(), [&](std::size_t a, std::size_t b) { return time[a] < time[b]; });
  return front;
}

// Few distinct values, so that ties in one or both are common.
RC_GTEST_PROP(ParetoFront, agrees_with_brute_force, ()) {
  const auto points = *rc::gen::container<std::vector<std::pair<int, int>>>(
      rc::gen::pair(rc::gen::inRange(0, 9), rc::gen::inRange(0, 9)));
  std::vector<double> time;
  std::vector<double> error;
  for (const auto& [t, e] : points) {
    time.push_back(t);
    error.push_back(e);
  }
  RC_ASSERT(pareto_front(time, error) == brute_force(time, error));
}

RC_GTEST_PROP(ParetoFront, agrees_with_brute_force_on_any_finite_numbers,
              (std::vector<std::pair<double, double>> points)) {
  std::vector<double> time;
  std::vector<double> error;
  for (const auto& [t, e] : points) {
    time.push_back(t);
    error.push_back(e);
  }
  RC_ASSERT(pareto_front(time, error) == brute_force(time, error));
}

Indices front_of(const std::vector<double>& time, const std::vector<double>& error) {
  return pareto_front(time, error);
}

TEST(ParetoFront, of_nothing_is_empty) { EXPECT_EQ(front_of({}, {}), Indices{}); }

TEST(ParetoFront, keeps_a_single_point) { EXPECT_EQ(front_of({3}, {0}), Indices{0}); }

TEST(ParetoFront, keeps_a_single_infinite_point) {
  EXPECT_EQ(front_of({3}, {std::numeric_limits<double>::infinity()}), Indices{0});
}

TEST(ParetoFront, keeps_the_first_of_equals) { EXPECT_EQ(front_of({2, 2, 2}, {1, 1, 1}), Indices{0}); }

TEST(ParetoFront, keeps_a_perfect_zero) { EXPECT_EQ(front_of({1, 2, 3}, {1, 0.5, 0}), (Indices{0, 1, 2})); }

TEST(ParetoFront, drops_the_slower_of_equal_errors) { EXPECT_EQ(front_of({2, 1}, {0, 0}), Indices{1}); }

TEST(ParetoFront, drops_the_worse_of_equal_times) { EXPECT_EQ(front_of({1, 1}, {0.2, 0.1}), Indices{1}); }

TEST(ParetoFront, takes_minus_zero_for_zero) { EXPECT_EQ(front_of({1, 2}, {0.0, -0.0}), Indices{0}); }

TEST(ParetoFront, refuses_nan_and_uneven_lengths) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)front_of({1, nan}, {0, 0}), Error);
  EXPECT_THROW((void)front_of({1, 2}, {0, nan}), Error);
  EXPECT_THROW((void)front_of({1, 2}, {0}), Error);
}

std::vector<std::string> ids_of(const std::vector<const Record*>& records) {
  std::vector<std::string> result;
  for (const Record* record : records) result.push_back(record->case_id);
  return result;
}

TEST(Fronts, are_kept_apart_by_device_and_scene) {
  const std::vector<Record> records = {
      make_record({.case_id = "slow", .time_ns = 9000, .scene = "b"}),
      make_record({.case_id = "fast", .time_ns = 1000, .scene = "a"}),
      make_record({.case_id = "other", .time_ns = 5000, .scene = "a", .backend = "opengl"}),
  };
  const std::vector<Front> result = fronts(records, "e_xy.p99", {});
  ASSERT_EQ(result.size(), 3U);
  EXPECT_EQ(result[0].scene, "a");
  EXPECT_EQ(result[1].scene, "b");
  EXPECT_EQ(result[1].points.at(0).record->case_id, "slow");
  EXPECT_EQ(result[2].backend, "opengl");
}

TEST(Fronts, take_only_measured_cases_that_meet_the_constraints) {
  std::vector<Record> records = {
      make_record({.case_id = "misses", .time_ns = 1000, .missed_rate = 0.5}),
      make_record({.case_id = "failed", .time_ns = 500}),
      make_record({.case_id = "good", .time_ns = 2000, .missed_rate = 0.001}),
  };
  records[1].status = Status::device_lost;
  const std::vector<Budget> constraints = {{"missed_rate", 0.001}};
  const std::vector<Front> result = fronts(records, "e_xy.p99", constraints);
  ASSERT_EQ(result.size(), 1U);
  ASSERT_EQ(result[0].points.size(), 1U);
  EXPECT_EQ(result[0].points[0].record->case_id, "good");
}

TEST(Fronts, name_the_cases_that_measurement_cannot_tell_apart) {
  const std::vector<Record> records = {
      make_record({.case_id = "front", .time_ns = 1000, .e_xy_p99 = 0.5}),
      make_record({.case_id = "twin", .time_ns = 1000, .e_xy_p99 = 0.5}),
      make_record({.case_id = "within noise", .time_ns = 1015, .e_xy_p99 = 0.5}),
      make_record({.case_id = "beyond noise", .time_ns = 1030, .e_xy_p99 = 0.5}),
      make_record({.case_id = "worse", .time_ns = 1005, .e_xy_p99 = 0.51}),
  };
  const std::vector<Front> result = fronts(records, "e_xy.p99", {});
  ASSERT_EQ(result.at(0).points.size(), 1U);
  EXPECT_EQ(ids_of(result[0].points[0].equivalents), (std::vector<std::string>{"twin", "within noise"}));
}

TEST(Fronts, refuse_metrics_that_no_front_can_have) {
  EXPECT_THROW((void)fronts({}, "psnr", {}), Error);
  EXPECT_THROW((void)fronts({}, "no_such", {}), Error);
}

TEST(Fronts, are_written_with_interval_constraints_and_equivalents) {
  const std::vector<Record> records = {make_record({.case_id = "only", .time_ns = 1000, .e_xy_p99 = 0})};
  const std::vector<Budget> constraints = {{"missed_rate", 0.001}};
  const nlohmann::json json = fronts_json(fronts(records, "e_xy.p99", constraints));
  EXPECT_EQ(json.at("schema"), kSchemaVersion);
  const nlohmann::json& front = json.at("fronts").at(0);
  EXPECT_EQ(front.at("constraints"), nlohmann::json({"missed_rate<=0.001"}));
  EXPECT_EQ(front.at("points").at(0), nlohmann::json({{"case", "only"},
                                                      {"time_ns", 1000.0},
                                                      {"ci", {990.0, 1010.0}},
                                                      {"coverage", 1 - 2.0 / 128},
                                                      {"error", 0.0},
                                                      {"equivalents", nlohmann::json::array()}}));
}

TEST(Meets, asks_a_least_value_where_higher_is_better) {
  Record record = make_record({.case_id = "a"});
  (*record.error)["psnr"] = 40;
  EXPECT_TRUE(meets(record, {"psnr", 40}));
  EXPECT_FALSE(meets(record, {"psnr", 40.1}));
  (*record.error)["psnr"].reset();
  EXPECT_TRUE(meets(record, {"psnr", 1000})) << "identical pictures";
}

TEST(Meets, counts_the_limit_itself_and_refuses_what_was_not_measured) {
  Record record = make_record({.case_id = "a", .e_xy_p99 = 0.5});
  EXPECT_TRUE(meets(record, {"e_xy.p99", 0.5}));
  EXPECT_FALSE(meets(record, {"e_xy.p99", 0.499}));
  record.status = Status::timeout;
  EXPECT_FALSE(meets(record, {"e_xy.p99", 0.5}));
}

}  // namespace
}  // namespace reliefbench
