#include "tuner/tune/tuners.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "reports/pages/tuners_page.h"
#include "tests/finished_run.h"
#include "tests/thorough.h"
#include "tuner/results/recorded_run.h"
#include "tuner/search/strategies.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Tuners : public ::testing::Test {
 protected:
  TempFolder folder_;
  const RecordedTable table_ = load_recorded(null_sweep(folder_), {});
};

TEST_F(Tuners, every_strategy_is_judged_at_every_share) {
  double last = 0;
  TunersOptions options{.seeds = 3, .shares = {0.2, 1}, .threads = 1};
  options.on_progress = [&](double fraction) {
    EXPECT_GT(fraction, last);
    last = fraction;
  };
  const TunerComparison comparison = compare_tuners(table_, options);
  EXPECT_EQ(last, 1);
  EXPECT_EQ(comparison.settings, 61);
  EXPECT_EQ(comparison.constraints, std::vector<std::string>{"missed_rate<=0.5"});
  ASSERT_EQ(comparison.lines.size(), strategies().size());
  for (std::size_t s = 0; s < comparison.lines.size(); ++s) {
    const TunerLine& line = comparison.lines[s];
    EXPECT_EQ(line.strategy, strategies()[s].id);
    ASSERT_EQ(line.points.size(), 2U);
    for (const TunerPoint& point : line.points) {
      EXPECT_LE(point.hypervolume.worst, point.hypervolume.mean + 1e-12);
      EXPECT_LE(point.hypervolume.mean, 1 + 1e-12);
      EXPECT_GE(point.worst_regret.worst, point.worst_regret.mean - 1e-12);
      EXPECT_GE(point.worst_regret.worst, point.worst_regret.most);
      EXPECT_LE(point.hypervolume.worst, point.hypervolume.most);
      EXPECT_LE(point.mean_regret.mean, point.worst_regret.mean);
      EXPECT_EQ(point.uncovered > 0, std::isinf(point.worst_regret.worst));
      EXPECT_LE(point.timed.worst, comparison.feasible * (point.share < 1 ? 0.2 : 1));
      EXPECT_GE(point.samples.mean, point.timed.mean);
    }
    EXPECT_GE(line.points[1].timed.mean, line.points[0].timed.mean) << line.strategy;
  }
}

TEST_F(Tuners, threads_change_nothing) {
  const TunersOptions one{.seeds = 4, .shares = {0.3}, .threads = 1};
  const TunersOptions many{.seeds = 4, .shares = {0.3}, .threads = 4};
  EXPECT_EQ(tuners_json(compare_tuners(table_, one)), tuners_json(compare_tuners(table_, many)));
}

TEST_F(Tuners, a_part_is_the_table_without_the_other_settings) {
  const RecordedTable part = random_part(table_, 0.8, 3);
  ASSERT_EQ(part.samples.size(), 48U);  // of 61
  ASSERT_EQ(part.space.candidates.size(), part.samples.size());
  ASSERT_EQ(part.memory_bytes.size(), part.samples.size());
  std::size_t place = 0;
  for (std::size_t i = 0; i < part.samples.size(); ++i, ++place) {  // in the table's order, each with its own
    while (table_.space.candidates.at(place).id != part.space.candidates[i].id) ++place;
    EXPECT_EQ(part.samples[i], table_.samples[place]);
    EXPECT_EQ(part.memory_bytes[i], table_.memory_bytes[place]);
    EXPECT_EQ(part.space.candidates[i].error, table_.space.candidates[place].error);
  }
  EXPECT_EQ(random_part(table_, 0.8, 3).samples, part.samples);
  EXPECT_NE(random_part(table_, 0.8, 4).samples, part.samples);
  EXPECT_EQ(random_part(table_, 1, 3).samples, table_.samples);
  EXPECT_EQ(random_part(table_, 1e-9, 3).samples.size(), 1U);
}

TEST_F(Tuners, each_seed_may_search_a_part_of_its_own) {
  const TunerComparison comparison = compare_tuners(table_, {.seeds = 8, .shares = {1}, .part = 0.5});
  EXPECT_EQ(tuners_json(comparison)["part"], 0.5);
  EXPECT_EQ(comparison.settings, 61);
  for (const TunerLine& line : comparison.lines) {
    const TunerPoint& point = line.points.front();
    EXPECT_EQ(point.timed.mean, 30) << line.strategy;
    EXPECT_LE(point.worst_regret.most, point.worst_regret.worst) << line.strategy;
    EXPECT_LE(point.worst_regret.worst, 0.02) << line.strategy;  // judged by its own part
  }
  EXPECT_EQ(comparison.certificate.seeds, 20);
  EXPECT_EQ(comparison.certificate.certified, 20);
}

TEST_F(Tuners, an_infinite_regret_is_null_and_the_page_holds_the_figures) {
  TunerComparison comparison = compare_tuners(table_, {.seeds = 1, .shares = {0.3}});
  comparison.lines[0].points[0].worst_regret = {.mean = INFINITY, .worst = INFINITY};
  comparison.scene = kHostileText;
  const nlohmann::json json = tuners_json(comparison);
  EXPECT_TRUE(json["strategies"][0]["points"][0]["worst_regret"]["mean"].is_null());
  write_tuners_page(comparison, folder_ / "t.html");
  const std::string page = read_file(folder_ / "t.html");
  EXPECT_THAT(page, HasSubstr("\"worst_regret\":{\"mean\":null"));
  EXPECT_THAT(page, Not(HasSubstr("{{")));
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
}

TEST_F(Tuners, nothing_to_compare_is_refused) {
  EXPECT_THROW((void)compare_tuners(table_, {.seeds = 0}), Error);
  EXPECT_THROW((void)compare_tuners(table_, {.shares = {}}), Error);
  EXPECT_THROW((void)compare_tuners(table_, {.part = 0}), Error);
  EXPECT_THROW((void)compare_tuners(table_, {.part = 1.5}), Error);
  RecordedTable infeasible = table_;
  for (Candidate& candidate : infeasible.space.candidates) candidate.is_feasible = false;
  EXPECT_THROW((void)compare_tuners(infeasible, {.seeds = 1}), Error);
}

/// A recorded exhaustive sweep of some 1,540 settings. rocks_disturbed is of a machine that was not quiet: in a third
/// of its settings some sample took half as long again as the others. On jacksboro no constant of the search was
/// chosen.
struct Recorded {
  const char* name;
  double
      frames;  ///< a setting that the certificate may cost: 1.5 times what it cost when it took frames for independent
};
void PrintTo(const Recorded& recorded, std::ostream* out) { *out << recorded.name; }

class TunersOnARecordedSweep : public ::testing::TestWithParam<Recorded> {
 protected:
  const int seeds_ = tried(20, 20, 4);
  const int certificates_ = tried(60, 200, 8);
  const int disturbed_ = tried(40, 200, 8);
  const RecordedTable table_ =
      load_recorded(fmt::format("{}/tests/data/exhaustive_{}.csv", RELIEFBENCH_SOURCE_DIR, GetParam().name), {});

  void expect_true(const CertificateCheck& check) const {
    EXPECT_EQ(check.certified, check.seeds);
    EXPECT_GE(check.held, 0.95 * check.seeds);
    EXPECT_GE(check.bounded, 0.95 * check.seeds);
    RecordProperty("bounded", check.bounded);
    RecordProperty("held", check.held);
    RecordProperty("frames", fmt::format("{:.2f}", check.frames_per_setting.mean));
  }
};

TEST_P(TunersOnARecordedSweep, ours_is_as_good_as_it_says) {
  const TunersOptions options{.seeds = seeds_, .shares = {0.03, 0.05}, .certificates = certificates_};
  const TunerComparison comparison = compare_tuners(table_, options);
  ASSERT_GE(comparison.settings, 1500);
  const auto line_of = [&](std::string_view id) -> const TunerLine& {
    return *std::ranges::find(comparison.lines, id, &TunerLine::strategy);
  };
  const TunerLine& ours = line_of("ours");
  EXPECT_GE(ours.points[0].hypervolume.worst, 0.99);
  EXPECT_LE(ours.points[1].worst_regret.worst, 0.03);
  EXPECT_EQ(ours.points[1].uncovered, 0);
  for (const std::string_view rival : {"random", "nsga2"})
    EXPECT_LT(line_of(rival).points[0].hypervolume.mean, ours.points[0].hypervolume.worst) << rival;
  expect_true(comparison.certificate);
  EXPECT_LE(comparison.certificate.frames_per_setting.mean, GetParam().frames);
}

// As measured on a loaded machine.
TEST_P(TunersOnARecordedSweep, certificates_are_true_on_a_loaded_machine) {
  expect_true(check_certificate(table_, {.seeds = disturbed_}, [](const RecordedTable& of, std::uint64_t seed) {
    return std::make_unique<ReplaySource>(of, seed, 0.65);
  }));
}

/// A replay on a machine whose speed swings by 1 % after correction, a swing taking some thousand frames.
class SwingingReplay final : public TimeSource {
 public:
  SwingingReplay(const RecordedTable& table, std::uint64_t seed, double correlation)
      : replay_(table, seed, correlation), phase_(static_cast<double>(seed)) {}
  double frame_ns(std::size_t candidate, int index) override {
    return replay_.frame_ns(candidate, index) * std::exp(0.01 * std::sin(phase_ + 2 * M_PI * drawn_++ / 1000));
  }

 private:
  ReplaySource replay_;
  double phase_;
  double drawn_ = 0;
};

// And .31: as the white noise of one control sample ties frames together that it corrects.
TEST_P(TunersOnARecordedSweep, certificates_are_true_while_the_machine_drifts) {
  expect_true(check_certificate(table_, {.seeds = disturbed_}, [](const RecordedTable& of, std::uint64_t seed) {
    return std::make_unique<SwingingReplay>(of, seed, 0.31);
  }));
}

INSTANTIATE_TEST_SUITE_P(All, TunersOnARecordedSweep,
                         ::testing::Values(Recorded{"rocks", 1.5 * 3.07}, Recorded{"rocks_disturbed", 1.5 * 6.90},
                                           Recorded{"bricks", 1.5 * 3.58}, Recorded{"jacksboro", 1.5 * 4.45}),
                         [](const auto& of) { return std::string(of.param.name); });

/// The search's constants were chosen on whole tables: random parts of them are others.
struct RecordedParts {
  const char* name;
  double regret;  ///< worst-budget regret at 5 % of the settings that 95 % of the parts keep, as measured on thirty
};
void PrintTo(const RecordedParts& recorded, std::ostream* out) { *out << recorded.name; }

class TunersOnPartsOfARecordedSweep : public ::testing::TestWithParam<RecordedParts> {};

TEST_P(TunersOnPartsOfARecordedSweep, ours_leaves_no_budget_and_certifies_the_truth) {
  const RecordedTable table =
      load_recorded(fmt::format("{}/tests/data/exhaustive_{}.csv", RELIEFBENCH_SOURCE_DIR, GetParam().name), {});
  constexpr int kParts = 30;
  const TunerComparison comparison =
      compare_tuners(table, {.seeds = kParts, .shares = {0.05}, .part = 0.8, .certificates = kParts});
  const TunerPoint& ours = std::ranges::find(comparison.lines, "ours", &TunerLine::strategy)->points.front();
  EXPECT_EQ(ours.uncovered, 0);
  EXPECT_LE(ours.worst_regret.most, GetParam().regret);
  EXPECT_GE(ours.hypervolume.worst, 0.994);
  EXPECT_EQ(comparison.certificate.certified, kParts);
  EXPECT_GE(comparison.certificate.held, 0.95 * kParts);
}

// On an H200 45 settings are on the front: to find it by 61, each must be foretold within 2 %.
INSTANTIATE_TEST_SUITE_P(All, TunersOnPartsOfARecordedSweep,
                         ::testing::Values(RecordedParts{"rocks", 0.03}, RecordedParts{"rocks_disturbed", 0.03},
                                           RecordedParts{"jacksboro", 0.03}, RecordedParts{"bricks", 0.035},
                                           RecordedParts{"rocks_h200", 0.1}),
                         [](const auto& of) { return std::string(of.param.name); });

}  // namespace
}  // namespace reliefbench
