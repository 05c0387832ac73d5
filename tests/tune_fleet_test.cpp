// Tuning with a fleet: the setting for other devices and this one, found with the times that decide it.
#include "tuner/tune/tune_fleet.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tuner/plan/setting_space.h"
#include "tuner/search/gaps.h"
#include "tuner/search/random.h"
#include "tuner/search/search.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

const std::string kRecordedTables = std::string(RELIEFBENCH_SOURCE_DIR) + "/tests/data/";
const std::string kProcessor = kRecordedTables + "exhaustive_rocks.csv";
const std::string kGpu = kRecordedTables + "exhaustive_rocks_h200.csv";

/// Few settings meet these on both devices, none of them is the best of either, and the least worst loss is 19 %.
const std::vector<std::string> kStrict = {"e_xy.p99<=0.1", "missed_rate<=0.001"};
/// Many do these, and 1.5 % are lost.
const std::vector<std::string> kWide = {"e_xy.p99<=8", "missed_rate<=0.01"};

TuneOptions with_fleet(const std::vector<std::string>& fleet, const std::vector<std::string>& budgets = kStrict,
                       Regret regret = Regret::minimax) {
  TuneOptions options{
      .question = {.max_error = parse_budgets(budgets)}, .fleet = TuneFleet{.regret = regret}, .quiet = true};
  for (const std::string& run : fleet) options.fleet->runs.push_back(load_fleet_run(run));
  return options;
}

/// What `choose` says where everything was measured everywhere.
struct Exhaustive {
  std::vector<FleetRun> runs;
  Fleet fleet;

  Exhaustive(const std::vector<std::string>& budgets, Regret regret)
      : runs{load_fleet_run(kProcessor), load_fleet_run(kGpu)},
        fleet(choose_for_fleet(runs, {.budgets = parse_budgets(budgets), .regret = regret})) {}
  [[nodiscard]] double loss_of(const Settings& settings) const {
    return std::ranges::find(fleet.settings, settings, &FleetSetting::settings)->combined.value;
  }
  [[nodiscard]] std::size_t samples() const {
    std::size_t samples = 0;
    for (const TableRow& row : runs.front().rows) samples += row.samples_ns.size();
    return samples;
  }
  /// Frames a setting that a search timed, of those whose loss is within 3 % of the least: there the choice is decided.
  [[nodiscard]] double frames_where_it_is_decided(const TuneResult& result) const {
    std::set<std::string> close;
    for (const FleetSetting& one : fleet.settings)
      if (one.combined.value <= fleet.settings.front().combined.value + 0.03) close.insert(setting_id(one.settings));
    int frames = 0;
    int timed = 0;
    for (std::size_t i = 0; i < result.space.candidates.size(); ++i) {
      if (!close.contains(result.space.candidates[i].id)) continue;
      frames += result.search.states[i].samples;
      timed += result.search.states[i].samples > 0 ? 1 : 0;
    }
    return timed > 0 ? static_cast<double>(frames) / timed : 0;
  }
};

TEST(TuneFleetTest, finds_the_setting_of_the_exhaustive_runs_with_fewer_timings) {
  for (const std::vector<std::string>& budgets : {kStrict, kWide}) {
    for (const Regret regret : {Regret::minimax, Regret::mean}) {
      const Exhaustive whole(budgets, regret);
      const double least = whole.fleet.settings.front().combined.value;
      for (const std::uint64_t seed : {1, 2}) {
        TuneOptions options = with_fleet({kGpu}, budgets, regret);
        options.question.seed = seed;
        const TuneResult result = replay_tune(kProcessor, "", options);
        ASSERT_TRUE(result.fleet) << result.fleet_refusal;
        EXPECT_TRUE(result.is_certified()) << result.claim();
        ASSERT_EQ(result.fleet->fleet.places.size(), 2U);
        const Settings& pick = result.fleet->fleet.settings.front().settings;
        // The recorded times are themselves known to a percent or two.
        EXPECT_LE(whole.loss_of(pick), least + 0.02) << setting_id(pick);
        EXPECT_LE(result.fleet->low, least + 0.02);
        EXPECT_GE(result.fleet->high, least - 0.02);
        EXPECT_LE(result.search.samples, static_cast<std::int64_t>(whole.samples()) / 3);
        const double decided = whole.frames_where_it_is_decided(result);
        const double usual = static_cast<double>(result.search.samples) / result.search.measured;
        std::cout << fmt::format(
            "{} {} seed {}: loss {:.4f} (exhaustive {:.4f}; bounds {:.4f} to {:.4f}), {} settings, {} frames "
            "(exhaustive {}, {}), {:.1f} a setting, {:.1f} where it is decided\n",
            budgets.front(), regret_id(regret), seed, whole.loss_of(pick), least, result.fleet->low, result.fleet->high,
            result.search.measured, result.search.samples, whole.runs.front().rows.size(), whole.samples(), usual,
            decided);
        EXPECT_GT(decided, 4 * usual);
        // The device's own best is known as well as without a fleet.
        ASSERT_TRUE(result.pick);
        EXPECT_LE(result.pick->gap, result.question.epsilon);
      }
    }
  }
}

TEST(TuneFleetTest, an_earlier_run_of_this_device_is_one_more_of_its_place) {
  const TuneResult result = replay_tune(kProcessor, "", with_fleet({kGpu, kProcessor}));
  ASSERT_TRUE(result.fleet);
  ASSERT_EQ(result.fleet->fleet.places.size(), 2U);
  EXPECT_EQ(result.fleet->fleet.places.front().runs, (std::vector<std::size_t>{0, 2}));
  EXPECT_TRUE(result.fleet->fleet.places.front().between_runs);
  // Alone it leaves the search what it is without a fleet.
  TuneOptions plain = with_fleet({});
  plain.fleet.reset();
  EXPECT_EQ(replay_tune(kProcessor, "", with_fleet({kProcessor})).pick->setting,
            replay_tune(kProcessor, "", plain).pick->setting);
}

TEST(TuneFleetTest, goes_on_and_refuses_another_fleet_or_scene) {
  const TempFolder folder;
  TuneOptions options = with_fleet({kGpu});
  options.output = folder / "kept";
  const nlohmann::json told = tune_json(replay_tune(kProcessor, "", options));
  EXPECT_EQ(schema_errors(told, "tune"), "");
  EXPECT_EQ(tune_json(replay_tune(kProcessor, "", options)), told);  // from the journal alone
  options.fleet->regret = Regret::mean;
  EXPECT_THROW(static_cast<void>(replay_tune(kProcessor, "", options)), Error);
  try {
    static_cast<void>(replay_tune(kProcessor, "", with_fleet({kRecordedTables + "exhaustive_bricks.csv"})));
    FAIL() << "took a run of another scene";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    EXPECT_THAT(error.what(),
                HasSubstr("exhaustive_bricks.csv: measured nothing of the scene that is tuned on, rocks/"));
    EXPECT_THAT(error.what(), HasSubstr("it has bricks/"));
  }
}

TEST(TuneFleetTest, a_device_is_tuned_with_runs_of_others) {
  const TempFolder folder;
  const std::filesystem::path sweep = null_sweep(folder);
  TuneOptions options{.output = folder / "tuned", .backend = "null", .quiet = true};
  options.question.max_error = {parse_budget("missed_rate<=0.5")};
  options.fleet.emplace();
  options.fleet->runs.push_back(load_fleet_run(sweep));
  for (TableRow& row : options.fleet->runs.front().rows) {
    row.device = "another device";
    if (row.settings.technique().id == "relief")  // which it draws slowly
      for (double& time_ns : row.samples_ns) time_ns *= 5;
  }
  const Config config = load_config(folder / "config.json");
  const TuneResult result = run_tune(config, options);
  ASSERT_TRUE(result.fleet) << result.fleet_refusal;
  ASSERT_EQ(result.fleet->fleet.places.size(), 2U);
  EXPECT_EQ(result.fleet->fleet.places[1].device.device, "another device");
  EXPECT_EQ(schema_errors(tune_json(result), "tune"), "");
  // Its setting has a whole record in the folder, as those that answer for this device have.
  const Settings& pick = result.fleet->fleet.settings.front().settings;
  const reliefbench::Run run = load_run(folder / "tuned");
  EXPECT_TRUE(
      std::ranges::any_of(run.records, [&](const Record& record) { return parse_setting(record.case_id) == pick; }));
  for (TableRow& row : options.fleet->runs.front().rows) row.scene_key = SceneKey{std::string(64, 'a')};
  options.output = folder / "other";
  EXPECT_THROW(static_cast<void>(run_tune(config, options)), Error);
}

TEST(TuneFleetTest, the_command_says_it_and_report_makes_the_same_page) {
  const TempFolder folder;
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"tune", "--replay", kProcessor, "--quiet", "--fleet", kGpu};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_reliefbench(arguments, folder.path());
  };
  CommandResult result = run({"-o", "tuned"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("One setting for 2 places with e_xy.p99<=0.5 and missed_rate<=0.001"));
  EXPECT_THAT(result.out, HasSubstr("vulkan NVIDIA H200 in rocks/grazing"));
  EXPECT_THAT(result.out, HasSubstr("Of all that were scored, timed or not: none loses less than "));
  const std::string page = file_text(folder / "tuned/tune.html");
  EXPECT_THAT(page, HasSubstr("common_settings"));
  result = run_reliefbench({"report", "tuned"}, folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "tuned/tune.html\n");
  EXPECT_TRUE(file_text(folder / "tuned/tune.html") == page) << "report's page of the folder is another";
  result = run({"--max-time-ms", "2"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--fleet chooses the fastest within bounds on error"));
}

/// Frames of settings whose log times are known, with noise.
class MadeTimes final : public TimeSource {
 public:
  explicit MadeTimes(std::vector<double> log_times) : log_times_(std::move(log_times)) {}
  [[nodiscard]] double frame_ns(std::size_t candidate, int /*index*/) override {
    return std::exp(log_times_[candidate] + 0.08 * (random_.uniform() + random_.uniform() + random_.uniform() - 1.5));
  }

 private:
  std::vector<double> log_times_;
  Random random_{5};
};

// Where the times here decide: what one setting loses elsewhere another loses here.
TEST(RegretRules, frames_go_where_the_choice_is_decided) {
  constexpr std::size_t kSettings = 80;
  Random random(11);
  SearchSpace space{.category_axes = {"setting"}, .step_axes = {}, .candidates = {}};
  std::vector<double> log_times;
  for (std::size_t i = 0; i < kSettings; ++i) {
    const double place = static_cast<double>(i) / kSettings;
    space.candidates.push_back(
        {.id = std::to_string(i), .categories = {static_cast<int>(i)}, .steps = {}, .error = 0.6 * place});
    log_times.push_back(std::log1p(0.6 * (1 - place)) + 0.02 * random.uniform());
  }
  const RegretRule rule{.is_worst = true};
  const double fastest = std::ranges::min(log_times);
  std::vector<double> regrets;
  for (std::size_t i = 0; i < kSettings; ++i)
    regrets.push_back(rule.regret(space.candidates[i].error, std::exp(log_times[i] - fastest)));
  const double least = std::ranges::min(regrets);
  const auto share_where_decided = [&](const SearchResult& result) {
    double frames = 0;
    for (std::size_t i = 0; i < kSettings; ++i)
      if (regrets[i] < least + 0.04 || log_times[i] < fastest + 0.04) frames += result.states[i].samples;
    return frames / static_cast<double>(result.samples);
  };
  MadeTimes times(log_times);
  const SearchResult asked = search(space, times, {.regret = rule});
  ASSERT_TRUE(asked.is_certified);
  EXPECT_LE(regrets[asked.least_regret->pick], least + 0.03);
  EXPECT_LE(asked.least_regret->low, least);
  EXPECT_GE(asked.least_regret->high, least);
  MadeTimes again(log_times);
  const SearchResult front = search(space, again, {});
  std::cout << fmt::format("{} frames, {:.2f} of them where it is decided; the whole front {}, {:.2f}\n", asked.samples,
                           share_where_decided(asked), front.samples, share_where_decided(front));
  EXPECT_LT(asked.samples, 0.6 * static_cast<double>(front.samples));
  EXPECT_GT(share_where_decided(asked), 1.5 * share_where_decided(front));
}

// Bounds that hold the times hold the least regret, and the setting of it is among those that still have a gap.
TEST(RegretRules, bounds_hold_the_least_regret) {
  Random random(7);
  for (int round = 0; round < 500; ++round) {
    const RegretRule rule{.is_worst = random.below(2) == 0, .own_share = 0.1 + 0.9 * random.uniform()};
    SearchSpace space;
    std::vector<double> truth;
    const std::size_t settings = 2 + random.below(8);
    for (std::size_t i = 0; i < settings; ++i) {
      space.candidates.push_back({.id = std::to_string(i), .categories = {}, .steps = {}, .error = random.uniform()});
      if (random.below(6) == 0) space.candidates.back().error = std::numeric_limits<double>::infinity();
      truth.push_back(random.uniform());
    }
    const double fastest = std::ranges::min(truth);
    double least = std::numeric_limits<double>::infinity();
    Gaps gaps(space, rule);
    for (std::size_t i = 0; i < settings; ++i) {
      const double above = random.below(5) == 0 ? std::numeric_limits<double>::infinity() : random.uniform() / 10;
      gaps.set(i, truth[i] - random.uniform() / 10, truth[i] + above);
      least = std::min(least, rule.regret(space.candidates[i].error, std::exp(truth[i] - fastest)));
    }
    const Gaps::LeastRegret found = gaps.least_regret();
    EXPECT_LE(found.low, least);
    if (std::isinf(found.high)) continue;
    EXPECT_GE(found.high,
              rule.regret(space.candidates[found.pick].error, std::exp(truth[found.pick] - fastest)) - 1e-12);
    // Once all gaps are closed, the least regret is known as well as the times.
    for (std::size_t i = 0; i < settings; ++i) gaps.set(i, truth[i] - 1e-6, truth[i] + 1e-6);
    EXPECT_NEAR(gaps.least_regret().low, least, 1e-4);
    EXPECT_NEAR(gaps.least_regret().high, least, 1e-4);
    EXPECT_EQ(gaps.answers().size(), 1U);
    const double limit = rule.most_ratio(0.1, 0.4);
    EXPECT_NEAR(rule.regret(0.1, limit), 0.4, 1e-12);
  }
}

}  // namespace
}  // namespace reliefbench
