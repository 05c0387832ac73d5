// Names stand for people: two scenes of one name, one scene of two names, heightmaps that change. On the null backend,
// whose hits are as near to the exact ones as the steps allow.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "tests/command.h"
#include "tests/full_record.h"
#include "tests/own_cache.h"
#include "tests/schema.h"
#include "tests/temp_folder.h"
#include "tests/test_heightmap.h"
#include "tests/written_tables.h"
#include "tuner/decide/compare.h"
#include "tuner/decide/pareto.h"
#include "tuner/measure/sweep.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

class IdentityTest : public ::testing::Test {
 protected:
  /// A config of one scene, which `scene` completes.
  [[nodiscard]] Config config(const json& scene) const {
    json whole = {{"heightmap", "fbm"}, {"views", "oblique"}, {"frame_px", {32, 32}}};
    whole.update(scene);
    const json config = {{"scenes", {whole}},
                         {"measure", {{"samples", 3}, {"batch_ms", 0.1}, {"warmup_batches_max", 1}}},
                         {"sweeps",
                          {{{"technique", "flat"}},
                           {{"technique", "relief"}, {"axes", {{"linear_steps", {4, 16, 64}}, {"refinement", "none"}}}},
                           {{"technique", "cone"}, {"axes", {{"cone_steps", {8, 32}}}}}}}};
    return parse_config(config.dump(), folder_ / "config.json");
  }
  reliefbench::Run sweep(const json& scene, const std::string& name, const std::string& filter = "") const {
    const SweepOptions options{.output = folder_ / name, .backends = {"null"}, .filter = filter, .quiet = true};
    return load_run(run_sweep(config(scene), options).folder);
  }
  [[nodiscard]] json file_scene(const std::string& name) const {
    return {{"heightmap", (folder_ / name).string()}, {"views", "oblique"}};
  }
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments) const {
    return run_reliefbench(arguments, folder_.path());
  }
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

const json kSmallMap = {{"source", "fbm"}, {"width", 32}, {"height", 32}};

TEST_F(IdentityTest, runs_that_differ_in_seed_depth_or_frame_have_no_case_in_common) {
  const reliefbench::Run base = sweep({{"heightmap", kSmallMap}}, "base");
  json seeded = kSmallMap;
  seeded["seed"] = 2;
  const std::vector<json> others = {{{"heightmap", seeded}},
                                    {{"heightmap", kSmallMap}, {"relief_depth", 0.2}},
                                    {{"heightmap", kSmallMap}, {"frame_px", {48, 32}}},
                                    {{"heightmap", kSmallMap}, {"tiling", 2}},
                                    {{"heightmap", kSmallMap}, {"wrap", "clamp"}}};
  const std::vector<std::string> differs = {"heights ", "relief depth 0.1, now 0.2\n", "frame 32x32, now 48x32\n",
                                            "tiling 1, now 2\n", "wrap repeat, now clamp\n"};
  for (std::size_t i = 0; i < others.size(); ++i) {
    SCOPED_TRACE(others[i]);
    const std::string name = "other" + std::to_string(i);
    const reliefbench::Run other = sweep(others[i], name);
    for (std::size_t r = 0; r < base.records.size(); ++r) {
      ASSERT_EQ(other.records[r].case_id, base.records[r].case_id);
      EXPECT_NE(other.records[r].scene_key, base.records[r].scene_key);
      EXPECT_NE(other.records[r].timing_key, base.records[r].timing_key);
    }
    const CommandResult result = run({"compare", "base", name});
    EXPECT_EQ(result.exit_code, 5) << result.out << result.err;
    EXPECT_THAT(result.out, Not(HasSubstr("slower")));
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("scene 'fbm_32x32/oblique' is not the same, its cases are not compared: " + differs[i]),
                      HasSubstr("no case was measured in both runs")));
  }
}

TEST_F(IdentityTest, a_scene_under_another_name_is_the_same_scene) {
  write_heightmap(folder_ / "a/rocks.pgm", 1);
  write_heightmap(folder_ / "b/stones.pgm", 1);
  const reliefbench::Run base = sweep(file_scene("a/rocks.pgm"), "base");
  const reliefbench::Run renamed = sweep(file_scene("b/stones.pgm"), "renamed");
  EXPECT_EQ(base.records[0].scene_key, renamed.records[0].scene_key);
  EXPECT_EQ(compare_runs(base, renamed, {}).matched, base.records.size());
  // In one run both names may stand for it: then each case has its own twin.
  reliefbench::Run both = base;
  both.records.insert(both.records.end(), renamed.records.begin(), renamed.records.end());
  both.samples.insert(both.samples.end(), renamed.samples.begin(), renamed.samples.end());
  EXPECT_EQ(compare_runs(both, both, {}).matched, both.records.size());
}

TEST(RecordGroups, of_one_name_and_two_keys_are_two) {
  std::vector<Record> records = {full_record(), full_record(), full_record()};
  records[1].scene_key = parse_scene_key(std::string(64, 'e'));
  const std::vector<RecordGroup> groups = group_records(records);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].records.size(), 2U);
  EXPECT_EQ(groups[1].scene_key, records[1].scene_key);
  EXPECT_NE(match_key(records[0]), match_key(records[1]));
  EXPECT_EQ(fronts(records, "e_xy.p99", {}).size(), 2U);
}

TEST_F(IdentityTest, records_and_tables_have_the_key_and_one_name_has_one) {
  const reliefbench::Run made = sweep({{"heightmap", kSmallMap}}, "run");
  ASSERT_EQ(made.scenes.size(), 1U);
  EXPECT_EQ(schema_errors(made.info, "run"), "");
  for (const Record& record : made.records) EXPECT_EQ(record.scene_key, made.scenes[0].key);
  std::vector<TableRow> rows = case_table(made);
  const std::string table = case_table_csv(rows);
  EXPECT_EQ(parse_case_table(table, "t.csv").back().scene_key, made.scenes[0].key);
  rows.back().scene_key = parse_scene_key(std::string(64, 'a'));
  EXPECT_THAT([&] { (void)parse_case_table(case_table_csv(rows), "t.csv"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("two scenes are called 'fbm_32x32/oblique'"), HasSubstr("aaaaaaaa"),
                                         HasSubstr(made.scenes[0].key.short_text()))));

  std::string lines = file_text(folder_ / "run/results.jsonl");
  const std::size_t last = lines.rfind(made.scenes[0].key.hex);
  lines.replace(last, 64, std::string(64, 'b'));
  write_atomically(folder_ / "run/results.jsonl", lines);
  EXPECT_THAT([&] { (void)load_run(folder_ / "run"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("two scenes are called"), HasSubstr("bbbbbbbb"))));
}

TEST(RecordedTables, without_keys_are_read_by_their_scenes_ids) {
  const std::string path = std::string(RELIEFBENCH_SOURCE_DIR) + "/tests/data/exhaustive_rocks.csv";
  const std::vector<TableRow> rows = parse_case_table(file_text(path), path);
  ASSERT_GT(rows.size(), 1500U);
  EXPECT_FALSE(rows.front().scene_key.is_known());
  EXPECT_NE(rows.front().scene, "");
}

TEST_F(IdentityTest, runs_of_the_schema_before_are_refused_in_one_line) {
  static_cast<void>(sweep({{"heightmap", kSmallMap}}, "run"));
  json info = json::parse(file_text(folder_ / "run/run.json"));
  info["identity"]["schema"] = kSchemaVersion - 1;
  info["identity"]["kernels_sha256"] = std::string(64, '0');  // as the build of then had it
  write_atomically(folder_ / "run/run.json", info.dump());
  const std::string refusal = "key 'identity.schema': is 2, this reliefbench reads 3; measure it anew";
  const CommandResult result = run({"recommend", "run"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(refusal));
  EXPECT_THAT([&] { (void)sweep({{"heightmap", kSmallMap}}, "run"); }, ThrowsMessage<Error>(HasSubstr(refusal)));
}

class ChangedHeightmap : public IdentityTest {
 protected:
  ChangedHeightmap() { write_heightmap(folder_ / "rocks.pgm", 1); }
  /// Two hashes, and what to do.
  template <typename Work>
  void expect_refused(const Work& work) {
    const auto hash = [](std::uint32_t seed, const std::filesystem::path& path) {
      write_heightmap(path, seed);
      return short_key(Heightmaps().read({.source = path}).sha256);
    };
    const std::string before = hash(1, folder_ / "again/rocks.pgm");
    const std::string now = hash(2, folder_ / "again/rocks.pgm");
    EXPECT_THAT(work, ThrowsMessage<Error>(AllOf(HasSubstr("was measured on the heights " + before),
                                                 HasSubstr("now holds " + now), HasSubstr("put the heightmap back"))));
  }
};

TEST_F(ChangedHeightmap, does_not_go_on_with_a_sweep) {
  static_cast<void>(sweep(file_scene("rocks.pgm"), "run"));
  const std::string finished = file_text(folder_ / "run/results.jsonl");
  write_heightmap(folder_ / "rocks.pgm", 2);
  expect_refused([&] { (void)sweep(file_scene("rocks.pgm"), "run"); });
  // Unfinished: the first case alone is there.
  write_atomically(folder_ / "run/results.jsonl", finished.substr(0, finished.find('\n') + 1));
  expect_refused([&] { (void)sweep(file_scene("rocks.pgm"), "run"); });
  EXPECT_EQ(file_text(folder_ / "run/results.jsonl"), finished.substr(0, finished.find('\n') + 1));
  write_heightmap(folder_ / "rocks.pgm", 1);
  EXPECT_EQ(sweep(file_scene("rocks.pgm"), "run").records.size(), 6U);
}

TEST_F(ChangedHeightmap, does_not_go_on_with_a_search_or_its_hold_out) {
  const auto tune = [&](const std::string& map, const std::string& holdout, const std::string& name) {
    TuneOptions options;
    options.output = folder_ / name;
    options.backend = "null";
    options.quiet = true;
    options.holdout = config(file_scene(holdout)).scenes;
    return run_tune(config(file_scene(map)), options);
  };
  write_heightmap(folder_ / "other.pgm", 7);
  static_cast<void>(tune("rocks.pgm", "other.pgm", "tuned"));
  static_cast<void>(tune("other.pgm", "rocks.pgm", "held"));
  static_cast<void>(tune("rocks.pgm", "other.pgm", "tuned"));  // unchanged: goes on
  // Another file of the first hold-out's name is another hold-out.
  write_heightmap(folder_ / "more/rocks.pgm", 5);
  const std::string name = tune("other.pgm", "more/rocks.pgm", "held").holdout.at(0).scene;
  EXPECT_THAT(name, AllOf(HasSubstr("rocks."), HasSubstr("/oblique")));
  EXPECT_EQ(tune("other.pgm", "more/rocks.pgm", "held").holdout.at(0).scene, name);
  write_heightmap(folder_ / "rocks.pgm", 2);
  expect_refused([&] { (void)tune("rocks.pgm", "other.pgm", "tuned"); });
  expect_refused([&] { (void)tune("other.pgm", "rocks.pgm", "held"); });
}

TEST_F(IdentityTest, a_hold_out_of_the_training_maps_name_is_judged_on_its_own_texels) {
  write_heightmap(folder_ / "train/rocks.pgm", 1);
  write_heightmap(folder_ / "held/rocks.pgm", 2, 24);
  write_heightmap(folder_ / "held/more/rocks.pgm", 3, 20);
  write_heightmap(folder_ / "held/alias.pgm", 2, 24);
  const auto tune = [&](const std::vector<std::string>& holdouts, const std::string& name) {
    TuneOptions options;
    options.output = folder_ / name;
    options.backend = "null";
    options.quiet = true;
    options.question.max_error = {{"e_xy.p99", 1e9}};
    for (const std::string& holdout : holdouts)
      for (const SceneSpec& scene : config(file_scene(holdout)).scenes) options.holdout.push_back(scene);
    return run_tune(config(file_scene("train/rocks.pgm")), options);
  };
  const TuneResult alias = tune({"held/alias.pgm"}, "alias");
  const TuneResult same = tune({"held/rocks.pgm", "held/more/rocks.pgm"}, "same");
  ASSERT_EQ(alias.holdout.size(), 1U);
  ASSERT_EQ(same.holdout.size(), 2U);
  ASSERT_TRUE(same.pick);
  EXPECT_EQ(same.holdout[0].error, alias.holdout[0].error);
  EXPECT_EQ(same.holdout[0].scene_key, alias.holdout[0].scene_key);
  EXPECT_NE(same.holdout[0].error, same.pick->error);
  EXPECT_NE(same.holdout[0].error, same.holdout[1].error);
  EXPECT_EQ(schema_errors(tune_json(same), "tune"), "");
  // Each has a name of its own, in the records, too.
  std::set<std::string> names = {same.scenes[0], same.holdout[0].scene, same.holdout[1].scene};
  EXPECT_EQ(names.size(), 3U);
  const std::string hash = short_key(Heightmaps().read({.source = folder_ / "held/rocks.pgm"}).sha256);
  EXPECT_EQ(same.holdout[0].scene, fmt::format("rocks.{}/oblique", hash));
  for (const Record& record : load_run(folder_ / "same").records) names.insert(record.scene);
  EXPECT_EQ(names.size(), 3U);

  EXPECT_THAT([&] { (void)tune({"train/rocks.pgm"}, "trained"); },
              ThrowsMessage<Error>(HasSubstr("is what the pick is tuned on (scene 'rocks/oblique')")));
}

}  // namespace
}  // namespace reliefbench
