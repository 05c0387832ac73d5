#include "kernels/judge/score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>
#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr float kHit = 1;
constexpr float kStepCap = 2;
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr ReferenceHit kSolid{.t_enter = 0.25, .t_exit = 0.5};
constexpr int kSide = 100;  // with a slope of (0.6, 0.8): 100 texels per t

ScorePixel pixel(float t, float status = kHit, float taps = 0) {
  return {.ray = {.u = 0.1F, .v = 0.2F, .slope_u = 0.6F, .slope_v = 0.8F}, .t = t, .status = status, .taps = taps};
}
PixelScore pixel_score(const ScorePixel& pixel, const ReferenceHit& reference = kSolid) {
  return judge({&pixel, 1}, {&reference, 1}, kSide, kSide).pixels.front();
}

struct VerdictCase {
  const char* name;
  float t;
  float status;
  Verdict verdict;
};
class Verdicts : public testing::TestWithParam<VerdictCase> {};
TEST_P(Verdicts, FollowTheReference) {
  EXPECT_EQ(pixel_score(pixel(GetParam().t, GetParam().status)).verdict, GetParam().verdict);
}
INSTANTIATE_TEST_SUITE_P(
    Score, Verdicts,
    testing::Values(
        VerdictCase{"exact", 0.25F, kHit, Verdict::good}, VerdictCase{"just_before", 0.246F, kHit, Verdict::good},
        VerdictCase{"just_behind", 0.254F, kHit, Verdict::good},
        VerdictCase{"good_at_the_cap", 0.254F, kStepCap, Verdict::good},
        VerdictCase{"stopped_early", 0.24F, kHit, Verdict::unconverged},
        VerdictCase{"stopped_early_at_the_cap", 0.1F, kStepCap, Verdict::unconverged},
        VerdictCase{"inside", 0.26F, kHit, Verdict::inside}, VerdictCase{"deep_inside", 0.49F, kHit, Verdict::inside},
        VerdictCase{"inside_at_the_cap", 0.3F, kStepCap, Verdict::unconverged},
        VerdictCase{"at_the_exit", 0.5F, kHit, Verdict::missed}, VerdictCase{"behind", 0.9F, kHit, Verdict::missed},
        VerdictCase{"behind_at_the_cap", 0.9F, kStepCap, Verdict::missed},
        VerdictCase{"nan", std::numeric_limits<float>::quiet_NaN(), kHit, Verdict::missed},
        VerdictCase{"infinite", -std::numeric_limits<float>::infinity(), kStepCap, Verdict::missed},
        VerdictCase{"no_ray", 0.25F, 0, Verdict::no_ray}),
    [](const auto& row) { return std::string(row.param.name); });

TEST(Score, ErrorsAreAlongTheRay) {
  const PixelScore score = pixel_score(pixel(0.375F));
  EXPECT_FLOAT_EQ(score.e_z, 0.125F);
  EXPECT_FLOAT_EQ(score.e_xy, 12.5F);
}

TEST(Score, TexelsCountPerAxis) {
  const ScorePixel wide{.ray = {.u = 0, .v = 0, .slope_u = 0.5F, .slope_v = 0.5F}, .t = 0.5F, .status = kHit};
  EXPECT_FLOAT_EQ(judge({&wide, 1}, {&kSolid, 1}, 24, 10).pixels.front().e_xy, 0.25F * 13);
}

TEST(Score, NonFiniteHitCostsTheWholeTravel) {
  const PixelScore score = pixel_score(pixel(std::numeric_limits<float>::infinity()));
  EXPECT_FLOAT_EQ(score.e_xy, 100);
  EXPECT_EQ(score.e_z, 1);
}

TEST(Score, NonFiniteRayIsNoRay) {
  ScorePixel broken = pixel(0.25F);
  broken.ray.slope_u = std::numeric_limits<float>::infinity();
  EXPECT_EQ(pixel_score(broken).verdict, Verdict::no_ray);
}

TEST(Score, ErrorsStayFinite) {
  ScorePixel horizon = pixel(0.5F);
  horizon.ray.slope_u = 1e38F;
  EXPECT_EQ(pixel_score(horizon).e_xy, std::numeric_limits<float>::max());
}

TEST(Score, ATouchThatIsFoundIsNotMissed) {
  const ReferenceHit touch{.t_enter = 1.0 / 3, .t_exit = 1.0 / 3};
  const float nearest = 1.0F / 3;
  EXPECT_EQ(pixel_score(pixel(nearest), touch).verdict, Verdict::good);
  EXPECT_EQ(pixel_score(pixel(nearest + 1e-6F), touch).verdict, Verdict::missed);
}

TEST(Score, WhatNeverEndsIsNeverMissed) {
  EXPECT_EQ(pixel_score(pixel(1), {.t_enter = 0.25, .t_exit = kNever}).verdict, Verdict::inside);
}

/// What every judged frame has.
bool is_of_hits(const MetricRow& row) {
  return row.metric->feature.empty() && (std::holds_alternative<OfPixels>(row.metric->function) ||
                                         std::holds_alternative<OfVerdict>(row.metric->function));
}

TEST(Score, FrameCountsItsVerdictsOverPixelsWithARay) {
  const std::vector<ScorePixel> pixels{pixel(0.25F, kHit, 3), pixel(0.26F, kHit, 5), pixel(0.9F, kHit, 4),
                                       pixel(0.1F, kStepCap, 8), pixel(0, 0, 1000)};
  const std::vector<ReferenceHit> reference(pixels.size(), kSolid);
  const JudgedFrame frame = judge(pixels, reference, kSide, kSide);
  EXPECT_EQ(frame.pixels.size(), 5U);
  EXPECT_EQ(frame.score.pixels, 4);
  EXPECT_EQ(frame.score["missed_rate"], 0.25);
  EXPECT_EQ(frame.score["inside_rate"], 0.25);
  EXPECT_EQ(frame.score["unconverged_rate"], 0.25);
  EXPECT_EQ(frame.score["taps.mean"], 5);
  EXPECT_EQ(frame.score["taps.max"], 8);
  for (const MetricRow& row : metrics()) EXPECT_EQ(row.value(frame.score).has_value(), is_of_hits(row)) << row.id;
}

TEST(Score, AFeatureHasItsOwnMetricsAndNoOtherFrameHasThem) {
  const std::vector<ScorePixel> pixels{pixel(0.25F), pixel(0.25F), pixel(0.25F), pixel(0.25F), pixel(0, 0)};
  JudgedFrame frame = judge(pixels, std::vector<ReferenceHit>(pixels.size(), kSolid), kSide, kSide);
  EXPECT_EQ(frame.score["false_lit_rate"], std::nullopt);
  const FrameScore before = frame.score;
  const std::vector<float> found{1, 0.25F, 0.5F, 1, 0};
  const std::vector<float> exact{0, 0.5F, 0.25F, 1, 1};
  judge_feature("another", found, exact, frame.pixels, frame.score);
  EXPECT_EQ(frame.score, before);
  judge_feature("shadow", found, exact, frame.pixels, frame.score);
  EXPECT_EQ(frame.score.at("false_lit_rate"), 0.5);
  EXPECT_EQ(frame.score.at("false_dark_rate"), 0.25);
  EXPECT_EQ(frame.score.at("penumbra_error"), 1.5 / 4);
  FrameScore without_rays;
  judge_feature("shadow", found, exact, std::vector<PixelScore>(5), without_rays);
  EXPECT_EQ(without_rays.at("penumbra_error"), 0);
}

TEST(Score, FrameWithoutRaysIsZero) {
  const std::vector<ScorePixel> pixels(3);
  const JudgedFrame frame = judge(pixels, std::vector<ReferenceHit>(3), kSide, kSide);
  EXPECT_EQ(frame.score.pixels, 0);
  for (const MetricRow& row : metrics())
    EXPECT_EQ(row.value(frame.score), is_of_hits(row) ? std::optional(0.0) : std::nullopt) << row.id;
}

TEST(Score, PercentilesAreByNearestRank) {
  // Errors 1/1024 .. 200/1024 in height, in a shuffled order: 200 values, so the ranks are 100, 190 and 198.
  std::vector<ScorePixel> pixels;
  pixels.reserve(200);
  for (int i = 0; i < 200; ++i) pixels.push_back(pixel(static_cast<float>((i * 7) % 200 + 1) / 1024));
  const std::vector<ReferenceHit> reference(pixels.size(), ReferenceHit{.t_enter = 0, .t_exit = kNever});
  const FrameScore score = judge(pixels, reference, kSide, kSide).score;
  EXPECT_EQ(score["e_z.mean"], 100.5 / 1024);
  EXPECT_EQ(score["e_z.p50"], 100.0 / 1024);
  EXPECT_EQ(score["e_z.p95"], 190.0 / 1024);
  EXPECT_EQ(score["e_z.p99"], 198.0 / 1024);
  EXPECT_EQ(score["e_z.max"], 200.0 / 1024);
}

TEST(Score, PercentilesOfOnePixelAreIt) {
  const ScorePixel one = pixel(0.375F);
  const FrameScore score = judge({&one, 1}, {&kSolid, 1}, kSide, kSide).score;
  EXPECT_EQ(score["e_z.p50"], 0.125);
  EXPECT_EQ(score["e_z.p99"], 0.125);
}

std::optional<double> psnr_of(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, const RayMask& mask) {
  return psnr({.reference = a, .test = b, .width = static_cast<int>(mask.has_ray.size()), .height = 1}, mask);
}

TEST(Psnr, MatchesHandValues) {
  const RayMask mask{.has_ray = {1, 1}, .count = 2};
  const std::vector<std::uint8_t> black{0, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<std::uint8_t> white{255, 255, 255, 9, 255, 255, 255, 9};
  const std::vector<std::uint8_t> off_by_one{1, 1, 1, 0, 1, 1, 1, 0};
  const std::vector<std::uint8_t> other_alpha{0, 0, 0, 255, 0, 0, 0, 77};
  EXPECT_DOUBLE_EQ(psnr_of(black, white, mask).value(), 0);
  EXPECT_NEAR(psnr_of(black, off_by_one, mask).value(), 48.1308, 1e-4);
  EXPECT_FALSE(psnr_of(black, other_alpha, mask).has_value());
}

TEST(Psnr, LeavesOutPixelsWithoutARay) {
  const std::vector<std::uint8_t> a{10, 20, 30, 0, 10, 20, 30, 0};
  const std::vector<std::uint8_t> b{90, 90, 90, 0, 11, 21, 31, 0};
  EXPECT_NEAR(psnr_of(a, b, {.has_ray = {0, 1}, .count = 1}).value(), 48.1308, 1e-4);
  EXPECT_FALSE(psnr_of(a, b, {.has_ray = {0, 0}, .count = 0}).has_value());
}

TEST(Metrics, AreTheListThatReportsKnow) {
  std::vector<std::string> ids;
  for (const MetricRow& row : metrics()) ids.emplace_back(row.id);
  EXPECT_THAT(
      ids, testing::ElementsAre("e_xy.mean", "e_xy.p50", "e_xy.p95", "e_xy.p99", "e_xy.max", "e_z.mean", "e_z.p50",
                                "e_z.p95", "e_z.p99", "e_z.max", "missed_rate", "inside_rate", "unconverged_rate",
                                "psnr", "flip", "ssim", "flicker", "false_lit_rate", "false_dark_rate",
                                "penumbra_error", "e_depth", "wrong_visible_rate", "false_kill_rate", "false_keep_rate",
                                "false_hole_rate", "false_solid_rate", "coverage_error", "taps.mean", "taps.max"));
}

TEST(Metrics, ReadTheirOwnPlace) {
  FrameScore score;
  double expected = 0;
  for (std::optional<double>& value : score.values) value = ++expected;
  expected = 0;
  for (const MetricRow& row : metrics()) EXPECT_EQ(row.value(score), ++expected) << row.id;
  EXPECT_EQ(score["e_xy.p99"], 4);
  EXPECT_EQ(score["e_z.mean"], 6);
  EXPECT_EQ(score["psnr"], 14);
  EXPECT_EQ(score.at("taps.max"), 29);
  score["psnr"].reset();
  EXPECT_FALSE(find_metric("psnr").value(score).has_value());
  EXPECT_TRUE(find_metric("psnr").none_is_best());
  EXPECT_FALSE(find_metric("flicker").none_is_best());
}

TEST(Metrics, AreKnownByTheirIdsWhenCompiling) {
  for (const MetricRow& row : metrics()) EXPECT_EQ(metric_place(row.id), row.place) << row.id;
  static_assert(metric_place("e_xy.p99") == 3 && metric_place("missed_rate") == 10);
  for (const std::string_view id : {"", "e_xy", "e_xy.", "e_xy.p98", "e_xyp99", "missed_rate.mean", "taps.p50", "taps"})
    EXPECT_FALSE(metric_place(id).has_value()) << id;
}

TEST(Metrics, ThatCompareOrMoveAreFilledInByTheirFunctions) {
  const RayMask mask{.has_ray = {1, 1}, .count = 2};
  const std::vector<std::uint8_t> black{0, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<std::uint8_t> white{255, 255, 255, 0, 255, 255, 255, 0};
  FrameScore score;
  judge_pictures({.reference = black, .test = white, .width = 2, .height = 1}, mask, score);
  EXPECT_EQ(score["psnr"], 0);
  EXPECT_GT(score.at("flip"), 0.5);
  EXPECT_LT(score.at("ssim"), 0.1);
  EXPECT_FALSE(score["flicker"].has_value());

  const std::vector<PixelScore> pixels(2, PixelScore{.e_xy = 0, .e_z = 0, .verdict = Verdict::good});
  MotionJudge motion;
  motion.fill_in(score);
  EXPECT_FALSE(score["flicker"].has_value());  // nothing moved
  const auto frame = [&](const std::vector<std::uint8_t>& picture) {
    return FlickerFrame{.picture = picture, .reference = black, .mask = pixels};
  };
  motion.add(frame(black), frame(white));
  motion.add(frame(white), frame(white));
  motion.fill_in(score);
  EXPECT_EQ(score["flicker"], 0.5);
  EXPECT_FALSE(score["e_xy.p99"].has_value());
}

TEST(Metrics, TablesShowSomeOfThem) {
  std::vector<std::string_view> columns;
  for (const MetricRow& row : metrics())
    if (row.is_column()) columns.push_back(row.id);
  EXPECT_THAT(columns, testing::ElementsAre("e_xy.p99", "missed_rate", "psnr", "taps.mean"));
  for (const Metric& metric : kMetrics)
    EXPECT_TRUE(metric.column.empty() || metric_place(metric.column).has_value()) << metric.id;
}

TEST(Rays, AreTheSameBitByBit) {
  std::vector<ScorePixel> pixels(70'000);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].ray.u = static_cast<float>(i);
  pixels[5].ray.v = std::numeric_limits<float>::quiet_NaN();
  std::vector<TextureRay> rays = rays_of(pixels);
  EXPECT_EQ(rays[69'999].u, 69'999);
  EXPECT_TRUE(have_rays(pixels, rays));
  pixels.back().t = 1;
  EXPECT_TRUE(have_rays(pixels, rays));
  rays.back().slope_v = -0.0F;
  EXPECT_FALSE(have_rays(pixels, rays));
  rays.pop_back();
  EXPECT_FALSE(have_rays(pixels, rays));
}

TEST(Metrics, DescribeThemselves) {
  std::set<std::string_view> descriptions;
  for (const MetricRow& row : metrics()) {
    EXPECT_FALSE(row.unit.empty()) << row.id;
    EXPECT_TRUE(descriptions.insert(row.description).second) << row.id;
    EXPECT_EQ(row.lower_is_better, row.id != "psnr" && row.id != "ssim");
  }
}

TEST(Metrics, AreFoundByIdAndUnknownOnesNameTheChoices) {
  EXPECT_EQ(find_metric("e_z.p99").unit, "height");
  try {
    (void)find_metric("e_xy.p98");
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("e_xy.p98"), testing::HasSubstr("e_xy.p99, e_xy.max"),
                                             testing::HasSubstr("taps.max")));
  }
}

}  // namespace
}  // namespace reliefbench
