// The tuner's engine on a source that is neither a device nor a recorded run: it asks for no more than TuneSource.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "tuner/plan/setting_space.h"
#include "tuner/tune/tuner.h"

namespace reliefbench {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

std::string whole(const std::string& id) { return setting_id(parse_setting(id)); }

/// Three settings whose times are given.
class MadeSource final : public TuneSource {
 public:
  /// times_ns: of each setting, one a scene
  explicit MadeSource(const std::map<std::string, std::vector<double>>& times_ns) {
    for (const auto& [id, times] : times_ns) times_ns_.emplace(whole(id), times);
  }

  TuneResult blank() const override {
    TuneResult result{.error_metric = "e_xy.p99"};
    for (std::size_t scene = 0; scene < times_ns_.begin()->second.size(); ++scene)
      result.scenes.push_back("scene " + std::to_string(scene));
    result.counts.settings = result.counts.scored = static_cast<int>(times_ns_.size());
    return result;
  }
  std::optional<double> asked_error() const override { return std::nullopt; }
  SearchSpace space(std::span<const std::size_t> scenes) override {
    spaces.emplace_back(scenes.begin(), scenes.end());
    SearchSpace space = empty_setting_space();
    candidates_.clear();
    for (const auto& [id, times] : times_ns_) {
      if (id == left_out_) continue;
      candidates_.push_back(id);
      space.candidates.push_back(candidate_of(parse_setting(id), id));
      space.candidates.back().is_feasible = is_feasible;
    }
    return space;
  }
  std::unique_ptr<TimeSource> times(std::span<const std::size_t> scenes) override {
    struct Times final : TimeSource {
      Times(const MadeSource& source, std::span<const std::size_t> of) : made(source), scenes(of.begin(), of.end()) {}
      double frame_ns(std::size_t candidate, int index) override {
        const std::string& id = made.candidates_[candidate];
        if (id == made.broken) {
          Record record;
          record.case_id = id;
          throw CaseFailed(record);
        }
        double sum_ns = 0;
        for (const std::size_t scene : scenes) sum_ns += made.times_ns_.at(id)[scene];
        return sum_ns * (1 + 1e-4 * (index % 5));
      }
      const MadeSource& made;
      std::vector<std::size_t> scenes;
    };
    return std::make_unique<Times>(*this, scenes);
  }
  std::int64_t memory_bytes(std::size_t, std::size_t) override { return 1; }
  std::vector<double> times_ns(std::size_t scene, const std::string& setting) const override {
    return {times_ns_.at(setting)[scene]};
  }
  std::pair<std::string, std::string> nearest() const override { return {"relief", "by much"}; }
  TunePlace place() const override { return {}; }
  FleetRun timed_run() override { return {}; }
  void take_failure(const CaseFailed& failed, bool is_left_out) override {
    failures.emplace_back(failed.record.case_id, is_left_out);
    if (is_left_out) left_out_ = failed.record.case_id;
  }
  Progress& progress() override { return progress_; }

  bool is_feasible = true;
  std::string broken{};
  std::vector<std::pair<std::string, bool>> failures{};
  std::vector<std::vector<std::size_t>> spaces{};  ///< scenes of each that was asked for

 private:
  Progress progress_{true};
  std::map<std::string, std::vector<double>> times_ns_;
  std::vector<std::string> candidates_;
  std::string left_out_;
};

TuneOptions cheapest() {
  TuneOptions options;
  options.quiet = true;
  options.question.max_error = {{"e_xy.p99", 1}};  // one answer
  return options;
}
TuneResult tuned(MadeSource& source, const TuneOptions& options = cheapest()) {
  TuneClock clock(options);
  return tune(source, options, clock);
}

TEST(TunerEngine, finds_the_cheapest_of_all_scenes_then_of_each) {
  MadeSource source({{"cone", {100, 300}}, {"relief", {400, 200}}, {"interval", {900, 150}}});
  const TuneResult result = tuned(source);
  ASSERT_TRUE(result.pick);
  EXPECT_EQ(result.pick->setting, whole("cone"));
  EXPECT_TRUE(result.is_certified());
  EXPECT_FALSE(result.is_stopped);
  ASSERT_EQ(result.scene_answers.size(), 2U);
  EXPECT_EQ(result.scene_answers[0].own->setting, whole("cone"));
  EXPECT_EQ(result.scene_answers[1].own->setting, whole("interval"));
  EXPECT_EQ(result.scene_answers[0].gain, 0);
  EXPECT_EQ(result.scene_answers[1].common_ns, 300);
  EXPECT_EQ(result.scene_answers[1].own_ns, 150);
  EXPECT_EQ(result.scene_answers[1].gain, 0.5);
  EXPECT_THAT(source.spaces, ElementsAre(ElementsAre(0, 1), ElementsAre(0), ElementsAre(1)));
}

TEST(TunerEngine, leaves_out_a_setting_that_fails_and_comes_back) {
  MadeSource source({{"cone", {100}}, {"relief", {400}}, {"interval", {900}}});
  source.broken = whole("cone");
  const TuneResult result = tuned(source);
  EXPECT_THAT(source.failures, ElementsAre(Pair(whole("cone"), true)));
  EXPECT_EQ(result.counts.scored, 2);
  EXPECT_EQ(result.counts.failed, 1);
  ASSERT_TRUE(result.pick);
  EXPECT_EQ(result.pick->setting, whole("relief"));
  EXPECT_TRUE(result.scene_answers.empty());
}

TEST(TunerEngine, names_the_nearest_where_nothing_does) {
  MadeSource source({{"cone", {100}}, {"relief", {400}}});
  source.is_feasible = false;
  const TuneResult result = tuned(source);
  EXPECT_FALSE(result.pick);
  EXPECT_EQ(result.nearest, "relief");
  EXPECT_EQ(result.miss, "by much");
}

TEST(TunerEngine, stops_when_the_user_wants_no_more) {
  MadeSource source({{"cone", {100}}, {"relief", {400}}});
  TuneOptions options = cheapest();
  options.is_interrupted = [] { return true; };
  const TuneResult result = tuned(source, options);
  EXPECT_TRUE(result.is_stopped);
  EXPECT_FALSE(result.is_certified());
}

}  // namespace
}  // namespace reliefbench
