// The parts of tuning: the error pass, the ladder of features, ids of settings, the book of samples.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numeric>
#include <set>

#include "kernels/base/error.h"
#include "tests/made_score.h"
#include "tests/temp_folder.h"
#include "tuner/measure/sample_book.h"
#include "tuner/plan/features.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/tune/error_pass.h"

namespace reliefbench {
namespace {

Settings settings_with(std::string_view technique, const std::vector<std::pair<std::string_view, int>>& values) {
  Settings settings(find_technique(technique));
  for (const auto& [id, value] : values) settings.set(id, value);
  return settings;
}

FrameScore score_with(double error) {
  FrameScore score = made_score();
  score["e_xy.p99"] = error;
  return score;
}

bool never(std::size_t) { return false; }

TEST(SettingIds, are_read_back_for_every_technique) {
  for (const Technique& technique : techniques()) {
    const Settings settings(technique);
    EXPECT_EQ(parse_setting(setting_id(settings)), settings);
  }
  EXPECT_EQ(setting_id(parse_setting("relief@rocks/top?linear_steps=32&backend=vulkan")),
            setting_id(settings_with("relief", {{"linear_steps", 32}})));
  EXPECT_THROW(static_cast<void>(parse_setting("relief?linear_steps")), Error);
  EXPECT_THROW(static_cast<void>(parse_setting("relief?linear_stepz=3")), Error);
  EXPECT_THROW(static_cast<void>(parse_setting("releif")), Error);
}

RC_GTEST_PROP(CaseIds, are_read_back_whole, ()) {
  const Technique& technique = techniques()[*rc::gen::inRange<std::size_t>(0, techniques().size())];
  const Case spec{.settings = Settings(technique), .scene_id = "rocks/grazing", .backend = "vulkan"};
  const Case read = parse_case(spec.id());
  RC_ASSERT(read.id() == spec.id());
  RC_ASSERT(parse_case("relief").scene_id.empty() && parse_case("relief").backend.empty());
}

TEST(SettingNames, say_what_differs_from_the_defaults_and_a_key) {
  const Settings plain(find_technique("relief"));
  EXPECT_EQ(short_name(plain), "relief");
  const Settings changed = settings_with("relief", {{"linear_steps", 48}, {"binary_steps", 7}});
  EXPECT_EQ(short_name(changed), "relief linear_steps=48 binary_steps=7");
  EXPECT_TRUE(is_setting_key(setting_key(changed)));
  EXPECT_NE(setting_key(changed), setting_key(plain));
  EXPECT_EQ(named(changed), short_name(changed) + " [" + setting_key(changed) + "]");
  EXPECT_FALSE(is_setting_key("relief"));
  EXPECT_FALSE(is_setting_key("4CC2DCA1"));
  const std::vector<Settings> known{plain, changed};
  EXPECT_EQ(find_by_key(setting_key(changed), known), &known[1]);
  EXPECT_EQ(find_by_key("00000000", known), nullptr);
}

TEST(SettingSpace, chains_differ_in_names_and_lattices_in_counts) {
  const SearchSpace space = empty_setting_space();
  const Candidate a = candidate_of(settings_with("relief", {{"linear_steps", 16}}), "a");
  const Candidate b = candidate_of(settings_with("relief", {{"linear_steps", 32}}), "b");
  Settings other(find_technique("relief"));
  other.set("filter", "manual");
  EXPECT_EQ(a.categories, b.categories);
  EXPECT_NE(a.steps, b.steps);
  EXPECT_NE(candidate_of(other, "c").categories, a.categories);
  EXPECT_EQ(a.categories.size(), space.category_axes.size());
  EXPECT_EQ(a.steps.size(), space.step_axes.size());
}

/// A line of relief settings, with as many others that differ in their filter.
std::vector<Settings> two_lines(int count) {
  std::vector<Settings> settings;
  for (const std::string_view filter : {"hardware", "manual"})
    for (int i = 0; i < count; ++i) {
      settings.push_back(settings_with("relief", {{"linear_steps", 4 * (i + 1)}}));
      settings.back().set("filter", filter);
    }
  return settings;
}

RC_GTEST_PROP(ErrorPass, bisection_finds_what_a_full_pass_finds_where_error_falls_with_steps, ()) {
  const int count = *rc::gen::inRange(1, 40);
  const double limit = *rc::gen::inRange(0, 45);
  const std::vector<Settings> settings = two_lines(count);
  std::size_t frames = 0;
  const auto judge = [&](std::size_t i, std::size_t) {
    ++frames;
    return score_with(count - settings[i].get("linear_steps") / 4);
  };
  const auto meets = [&](const FrameScore& score) { return score.at("e_xy.p99") <= limit; };
  ErrorPass full_pass(settings, 1, {.judge = judge, .should_stop = never});
  full_pass.score_rest();
  const auto full = full_pass.take();
  const std::size_t full_frames = frames;
  frames = 0;
  ErrorPass pass(settings, 1, {.judge = judge, .should_stop = never});
  pass.bisect(meets);
  const auto some = pass.take();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const bool does = meets(full[i].scores.front());
    const bool is_first = does && (i % static_cast<std::size_t>(count) == 0 || !meets(full[i - 1].scores.front()));
    RC_ASSERT(some[i].scored != Scored::no);
    if (some[i].scored == Scored::assumed) RC_ASSERT(does && !is_first);
    if (some[i].scored == Scored::hopeless) RC_ASSERT(!does);
    if (is_first) RC_ASSERT(some[i].scored == Scored::yes);
  }
  RC_ASSERT(frames <= full_frames);
  if (count > 20) RC_ASSERT(frames <= 14U);
}

TEST(ErrorPass, failures_stay_with_their_setting_and_a_stop_leaves_the_rest) {
  const auto judge = [](std::size_t i, std::size_t) {
    if (i == 1) fail_environment("no such thing");
    return score_with(1);
  };
  const std::vector<Settings> settings = two_lines(2);
  ErrorPass pass(settings, 2, {.judge = judge, .should_stop = [](std::size_t done) { return done == 3; }});
  pass.score_rest();
  const auto results = pass.take();
  EXPECT_EQ(results[0].scored, Scored::yes);
  EXPECT_EQ(results[0].scores.size(), 2U);
  EXPECT_EQ(results[1].scored, Scored::failed);
  EXPECT_EQ(results[1].failure, "no such thing");
  EXPECT_EQ(results[3].scored, Scored::no);
}

TEST(ErrorPass, a_short_limit_still_scores_something_of_every_technique_and_nothing_twice) {
  std::vector<Settings> settings;
  for (const Technique& technique : techniques()) settings.insert(settings.end(), 50, Settings(technique));
  std::vector<int> frames(settings.size());
  const auto judge = [&](std::size_t i, std::size_t) {
    ++frames[i];
    return score_with(1);
  };
  const std::size_t few = techniques().size();
  ErrorPass pass(settings, 1, {.judge = judge, .should_stop = [&](std::size_t done) { return done == few; }});
  pass.score_coarse();
  for (std::size_t t = 0; t < few; ++t)
    EXPECT_EQ(
        std::accumulate(frames.begin() + static_cast<int>(50 * t), frames.begin() + static_cast<int>(50 * t + 50), 0),
        1)
        << techniques()[t].id;

  ErrorPass whole(settings, 1, {.judge = judge, .should_stop = never});
  frames.assign(settings.size(), 0);
  whole.score_coarse();
  EXPECT_EQ(std::ranges::count(frames, 1), static_cast<std::ptrdiff_t>(ErrorPass::kCoarse));
  whole.score_rest();
  EXPECT_EQ(std::ranges::count(frames, 1), static_cast<std::ptrdiff_t>(settings.size()));
}

RC_GTEST_PROP(ErrorPass, bisection_after_a_coarse_pass_still_draws_the_first_that_does, ()) {
  const std::vector<Settings> settings = two_lines(*rc::gen::inRange(1, 40));
  const double limit = *rc::gen::inRange(0, 45);
  const auto error = [&](std::size_t i) { return 40 - settings[i].get("linear_steps") / 4; };
  ErrorPass pass(settings, 1,
                 {.judge = [&](std::size_t i, std::size_t) { return score_with(error(i)); }, .should_stop = never});
  pass.score_coarse();
  pass.bisect([&](const FrameScore& score) { return score.at("e_xy.p99") <= limit; });
  const auto scores = pass.take();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const bool is_first = error(i) <= limit && (i % (settings.size() / 2) == 0 || error(i - 1) > limit);
    RC_ASSERT(scores[i].scored != Scored::no);
    if (is_first) RC_ASSERT(scores[i].scored == Scored::yes);
  }
}

TEST(Features, are_what_a_plain_trace_has_not) {
  EXPECT_TRUE(features(Settings(find_technique("flat"))).empty());
  Settings relief(find_technique("relief"));
  for (const auto& [id, value] : {std::pair("refinement", "none"), std::pair("loop", "fixed")}) relief.set(id, value);
  EXPECT_TRUE(features(relief).empty());
  relief.set("refinement", "binary");
  relief.set("format", "r16");
  EXPECT_EQ(features(relief), (std::vector<std::string>{"refinement=binary", "format=r16"}));
  const std::vector<std::string> cone = features(Settings(find_technique("cone")));
  EXPECT_EQ(cone.front(), "map=conservative");
}

TEST(Features, a_ladder_rises_in_features_and_falls_in_time) {
  const auto candidate = [](std::size_t count, std::size_t simplicity, double time_ns) {
    return RungCandidate{
        .features = std::vector<std::string>(count, "x"), .simplicity = simplicity, .time_ns = time_ns};
  };
  const std::vector<RungCandidate> candidates{candidate(3, 0, 5), candidate(1, 2, 9),  candidate(1, 1, 9),
                                              candidate(2, 0, 9), candidate(2, 0, 10), candidate(4, 0, 4)};
  EXPECT_EQ(ladder(candidates), (std::vector<std::size_t>{2, 0, 5}));
  EXPECT_TRUE(ladder({}).empty());
}

TEST(SampleBook, brings_samples_to_the_control_round_them_and_finds_them_again) {
  const TempFolder folder;
  const nlohmann::json identity = {{"schema", kSchemaVersion}};
  const SampleBook::Control control{.id = "control", .reference_ns = 100};
  double now_ns = 0;
  const auto sample = [&](const std::string& id, double time_ns) {
    return Sample{.case_id = id, .frames = 1, .frame_time_ns = time_ns, .at_ns = ++now_ns};
  };
  std::vector<double> times;
  {
    RunStore store(folder / "run", identity);
    SampleBook book(store, control);
    for (const double control_ns : {100.0, 200.0}) book.append(sample("control", control_ns));
    book.append(sample("a", 8));
    EXPECT_TRUE(book.times("a").empty());  // until the control case was drawn after it
    EXPECT_EQ(book.samples("a").size(), 1U);
    for (const double control_ns : {400.0, 500.0}) book.append(sample("control", control_ns));
    times = book.times("a");
    EXPECT_EQ(times, std::vector<double>{4});
    book.append(sample("a", 9));
    EXPECT_EQ(book.size(), 2U);
    EXPECT_TRUE(book.times("b").empty());
  }
  RunStore store(folder / "run", identity);
  SampleBook again(store, control);
  EXPECT_EQ(again.times("a"), times);
  again.append(sample("control", 450));
  EXPECT_EQ(again.times("a"), (std::vector<double>{4, 2}));
}

TEST(SampleBook, without_a_control_case_keeps_times_as_they_are) {
  const TempFolder folder;
  RunStore store(folder / "run", {{"schema", kSchemaVersion}});
  SampleBook book(store, std::nullopt);
  book.append({.case_id = "a", .frames = 1, .frame_time_ns = 8});
  EXPECT_EQ(book.times("a"), std::vector<double>{8});
}

}  // namespace
}  // namespace reliefbench
