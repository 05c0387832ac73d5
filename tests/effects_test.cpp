// What each axis of the space does, over matched pairs.
#include "tuner/decide/effects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/trace/technique.h"
#include "tests/made_score.h"
#include "tuner/results/budgets.h"

namespace reliefbench {
namespace {

using testing::DoubleNear;
using testing::SizeIs;

Record case_of(const Settings& settings, double time_ns, double error, const std::string& scene = "rocks/top") {
  Record record;
  record.technique = settings.technique().id;
  for (const SettingValue& given : settings.written()) record.params.emplace_back(given.param.id, given.text());
  record.case_id = scene + settings.text();
  record.scene = scene;
  record.backend = "null";
  record.device = "made";
  record.frame_time = FrameTime{.summary = {.median = time_ns, .ci_low = time_ns, .ci_high = time_ns, .n = 5},
                                .raw_median = time_ns,
                                .timer = "fenced_wall"};
  record.error = made_score();
  (*record.error)["e_xy.p99"] = error;
  return record;
}

std::vector<AxisEffect> on_axis(const std::vector<AxisEffect>& all, const std::string& axis) {
  std::vector<AxisEffect> found;
  std::ranges::copy_if(all, std::back_inserter(found), [&](const AxisEffect& effect) { return effect.axis == axis; });
  return found;
}

/// Of every step count, format and loop: time = steps * (half ? 1.5 : 1) * (fixed ? 2 : 1) with 10 % of noise.
std::vector<Record> made_space(const std::string& scene, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 0.1);
  std::vector<Record> records;
  for (const int steps : {8, 16, 32, 64, 128})
    for (const char* format : {"r8", "r16"})
      for (const char* loop : {"fixed", "early_exit"})
        for (const char* refinement : {"none", "binary"}) {
          Settings settings(find_technique("relief"));
          settings.set("linear_steps", steps);
          settings.set("format", format);
          settings.set("loop", loop);
          settings.set("refinement", refinement);
          const bool is_wide = std::string(format) == "r16";
          const double factor = (is_wide ? 1.5 : 1) * (std::string(loop) == "fixed" ? 2 : 1);
          records.push_back(
              case_of(settings, 1e3 * steps * factor * std::exp(normal(random)), is_wide ? 0 : 1.0 / steps, scene));
        }
  return records;
}

TEST(Effects, AreTheMedianRatiosOfMatchedPairs) {
  std::vector<Record> records = made_space("rocks/top", 1);
  for (const Record& record : made_space("rocks/grazing", 2)) records.push_back(record);
  const std::vector<AxisEffect> all = axis_effects(records);

  const std::vector<AxisEffect> formats = on_axis(all, "format");
  ASSERT_THAT(formats, SizeIs(1));
  EXPECT_EQ(formats[0].from, "r8");
  EXPECT_EQ(formats[0].to, "r16");
  EXPECT_EQ(formats[0].pairs, 40U);  // 5 steps, 2 loops, 2 refinements, 2 scenes
  EXPECT_THAT(formats[0].time.median, DoubleNear(1.5, 0.15));
  EXPECT_LT(formats[0].time.ci_low, 1.5);
  EXPECT_GT(formats[0].time.ci_high, 1.5);
  // An exact error counts as kLeastError: 1e-6 * 32.
  const std::size_t p99 = find_metric("e_xy.p99").place;
  ASSERT_TRUE(formats[0].errors[p99]);
  EXPECT_NEAR(formats[0].errors[p99]->median, kLeastError * 32, 1e-9);
  EXPECT_FALSE(formats[0].errors[find_metric("psnr").place]);

  const std::vector<AxisEffect> loops = on_axis(all, "loop");
  ASSERT_THAT(loops, SizeIs(1));
  EXPECT_EQ(loops[0].from + loops[0].to, "fixedearly_exit");
  EXPECT_THAT(loops[0].time.median, DoubleNear(0.5, 0.05));

  const std::vector<AxisEffect> steps = on_axis(all, "linear_steps");
  ASSERT_THAT(steps, SizeIs(1));
  EXPECT_EQ(steps[0].to, "2n");
  EXPECT_EQ(steps[0].pairs, 64U);  // 4 doublings, 2 formats, 2 loops, 2 refinements, 2 scenes
  EXPECT_THAT(steps[0].time.median, DoubleNear(2, 0.15));

  // binary_steps means something in one setting of each pair only.
  EXPECT_EQ(on_axis(all, "refinement")[0].pairs, 40U);
}

TEST(Effects, OfFormatAndEncodingTogetherWhereBothDiffer) {
  const auto cone = [](const char* format, const char* encoding, double time_ns) {
    Settings settings(find_technique("cone"));
    settings.set("format", format);
    settings.set("encoding", encoding);
    return case_of(settings, time_ns, 0.1);
  };
  const std::vector<Record> records = {cone("rg8", "sqrt", 1000), cone("rg16f", "ratio", 1200)};
  const std::vector<AxisEffect> all = axis_effects(records);
  ASSERT_THAT(all, SizeIs(1));
  EXPECT_EQ(all[0].axis, "format, encoding");
  EXPECT_EQ(all[0].from, "rg8 sqrt");
  EXPECT_EQ(all[0].to, "rg16f ratio");
  EXPECT_DOUBLE_EQ(all[0].time.median, 1.2);
}

TEST(Effects, AreOfOneDeviceAndOneSceneAndOfWhatWasMeasured) {
  Settings plain(find_technique("relief"));
  Settings wide(find_technique("relief"));
  wide.set("format", "r16");
  Record elsewhere = case_of(wide, 1000, 0.1);
  elsewhere.device = "another";
  Record failed = case_of(wide, 1000, 0.1);
  failed.status = Status::timeout;
  const std::vector<Record> records = {case_of(plain, 1000, 0.1), elsewhere, failed,
                                       case_of(wide, 1000, 0.1, "rocks/grazing")};
  EXPECT_THAT(axis_effects(records), SizeIs(0));
  EXPECT_THAT(axis_effects({}), SizeIs(0));
}

TEST(Effects, PriceFeaturesThatAreOnInsteadOfOff) {
  std::vector<Record> records;
  for (const char* shadow : {"none", "linear", "cone"})
    for (const char* format : {"rg8", "rg16"}) {
      Settings settings(find_technique("cone"));
      settings.set("format", format);
      settings.set("shadow", shadow);
      const std::string_view row = shadow;
      records.push_back(case_of(settings, row == "none" ? 100 : row == "linear" ? 150 : 180, row == "none" ? 4 : 1));
    }
  std::size_t priced = 0;
  for (const AxisEffect& effect : axis_effects(records)) {
    EXPECT_EQ(effect.prices_feature, effect.axis == "shadow" && effect.from == "none") << effect.axis << effect.from;
    if (!effect.prices_feature) continue;
    ++priced;
    EXPECT_EQ(effect.pairs, 2U);
    EXPECT_NEAR(effect.time.median, effect.to == "linear" ? 1.5 : 1.8, 1e-9);
  }
  EXPECT_EQ(priced, 2U);
}

}  // namespace
}  // namespace reliefbench
