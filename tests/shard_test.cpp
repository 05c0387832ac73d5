#include "tuner/plan/shard.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "kernels/base/error.h"
#include "tests/cli_rig.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::string_view kRelief = R"({"technique": "relief", "axes": {"linear_steps": [8, 16, 32, 64],
                                        "refinement": ["none", "secant", "binary"]}})";
constexpr std::string_view kCone = R"({"technique": "cone", "axes": {"cone_steps": [16, 32, 64],
                                      "correction": ["none", "safe"], "format": ["rg8", "rg16"]}})";
constexpr std::string_view kRelaxed = R"({"technique": "relaxed_cone", "axes": {"cone_steps": [8, 16]}})";
constexpr std::string_view kRocks = R"({"heightmap": "rocks", "views": ["top", "oblique"]})";
constexpr std::string_view kNoise =
    R"({"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": "grazing"})";

Config shared_config(std::initializer_list<std::string_view> scenes, std::initializer_list<std::string_view> sweeps) {
  return parse_config(
      fmt::format(R"({{"scenes": [{}], "sweeps": [{}]}})", fmt::join(scenes, ", "), fmt::join(sweeps, ", ")), "c.json");
}
Config usual_config() { return shared_config({kRocks, kNoise}, {kRelief, kCone, kRelaxed}); }

using Ids = std::set<std::string>;

Ids ids_of(const Plan& plan) {
  Ids ids;
  for (const Case& c : plan.cases) ids.insert(c.id());
  return ids;
}

Plan plan_on(const Config& config, const std::vector<std::string>& backends) { return make_plan(config, backends, ""); }

TEST(Shard, is_written_as_it_is_read) {
  EXPECT_EQ(parse_shard("2/7").text(), "2/7");
  EXPECT_EQ(parse_shard("1/1").of, 1);
  for (const char* bad : {"", "2", "0/3", "4/3", "-1/3", "1/0", "a/3", "1/3x", "1/", "/3", "1//3", "99999999999/3"})
    EXPECT_THAT([&] { (void)parse_shard(bad); }, ThrowsMessage<Error>(HasSubstr("is no shard: expected I/N"))) << bad;
}

// Whatever their number: every case is in one shard, no map is baked more often than said, and the sizes differ little.
TEST(Shard, all_of_them_are_the_plan) {
  const Config config = usual_config();
  const Plan plan = plan_on(config, {"opengl", "vulkan"});
  const auto settings = static_cast<int>(plan.cases.size() / 2);
  std::vector<int> numbers(13);
  std::iota(numbers.begin(), numbers.end(), 1);
  numbers.insert(numbers.end(), {settings / 2, settings - 1, settings});
  for (const int of : numbers) {
    Ids seen;
    std::size_t cases = 0;
    std::size_t bakes = 0;
    const double mean = static_cast<double>(plan.cases.size()) / of;
    for (int index = 1; index <= of; ++index) {
      const Plan part = shard_of(plan, config, {.index = index, .of = of});
      seen.merge(ids_of(part));
      cases += part.cases.size();
      bakes += part.bakes.size();
      EXPECT_LE(std::abs(static_cast<double>(part.cases.size()) - mean), std::max(2.0, mean / 4)) << index << "/" << of;
      std::set<std::string> own;
      for (const Case& c : part.cases)
        own.insert(bake_text(c.settings, *std::ranges::find(config.scenes, c.scene_id, &SceneSpec::id)));
      EXPECT_EQ(own, std::set(part.bakes.begin(), part.bakes.end()));
      EXPECT_EQ(part.bakes.size(), own.size());
    }
    EXPECT_EQ(seen, ids_of(plan)) << of;
    EXPECT_EQ(cases, plan.cases.size()) << of;
    EXPECT_LE(bakes, plan.bakes.size() + static_cast<std::size_t>(of) - 1) << of;
  }
  EXPECT_THAT([&] { (void)shard_of(plan, config, {.index = 1, .of = settings + 1}); },
              ThrowsMessage<Error>(HasSubstr("shards are too many")));
}

TEST(Shard, keeps_the_plans_order) {
  const Config config = usual_config();
  const Plan plan = plan_on(config, {"null"});
  const Plan part = shard_of(plan, config, {.index = 2, .of = 3});
  std::vector<std::string> all;
  for (const Case& c : plan.cases) all.push_back(c.id());
  std::vector<std::string> some;
  for (const Case& c : part.cases) some.push_back(c.id());
  std::erase_if(all, [&](const std::string& id) { return std::ranges::find(some, id) == some.end(); });
  EXPECT_EQ(some, all);
}

// Another order of scenes and sweeps, or other backends, and a setting of a scene is in the same shard.
TEST(Shard, goes_by_content_alone) {
  const Config config = usual_config();
  const Config turned = shared_config({kNoise, kRocks}, {kRelaxed, kCone, kRelief});
  const auto without_backend = [](const Ids& ids) {
    Ids stems;
    for (const std::string& id : ids) stems.insert(id.substr(0, id.rfind("backend=")));
    return stems;
  };
  for (const int of : {2, 3, 7})
    for (int index = 1; index <= of; ++index) {
      const Shard shard{.index = index, .of = of};
      const Ids ids = ids_of(shard_of(plan_on(config, {"opengl", "vulkan"}), config, shard));
      EXPECT_EQ(ids, ids_of(shard_of(plan_on(turned, {"vulkan", "opengl"}), turned, shard)));
      EXPECT_EQ(without_backend(ids), without_backend(ids_of(shard_of(plan_on(turned, {"null"}), turned, shard))));
    }
}

// Cones of 2 corrections and 2 types of heights on 2 heightmaps, relaxed ones on 2: maps that are a shard each.
TEST(Shard, begins_with_a_map_where_one_is_near) {
  const Config config = shared_config({kRocks}, {kCone});
  const Plan plan = plan_on(config, {"null"});
  const int maps = static_cast<int>(plan.bakes.size());
  ASSERT_GT(maps, 1);
  for (int index = 1; index <= maps; ++index)
    EXPECT_EQ(shard_of(plan, config, {.index = index, .of = maps}).bakes.size(), 1U);
}

class ShardedSweep : public CliTest {};

TEST_F(ShardedSweep, a_folder_holds_one_shard) {
  const std::vector<std::string> sweep = {"sweep", kSmoke, "--backend", "null", "--quiet", "-o", "one", "--shard"};
  const auto with = [&](const std::string& shard) {
    std::vector<std::string> command = sweep;
    command.push_back(shard);
    return command;
  };
  EXPECT_EQ(run(with("1/3")).exit_code, 0);
  EXPECT_EQ(load_run(folder_ / "one").info.at("identity").at("shard"), "1/3");
  EXPECT_THAT(run(with("1/3")).out, HasSubstr("from an earlier start")) << "gone on with";
  expect_refused(with("2/3"), 2, R"(holds another run: its 'shard' is "1/3", now it is "2/3")");
  expect_refused(with("4/3"), 2, "'4/3' is no shard");
  std::vector<std::string> dry = with("2/3");
  dry.emplace_back("--dry-run");
  EXPECT_THAT(run(dry).out, HasSubstr("shard 2 of 3: 3 of 9 cases, "));
  dry.emplace_back("--json");
  const nlohmann::json share = nlohmann::json::parse(run(dry).out).at("shard");
  EXPECT_EQ(share.at("index"), 2);
  EXPECT_EQ(share.at("cases_of_all"), 9);
}

}  // namespace
}  // namespace reliefbench
