#include "kernels/base/cache.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "kernels/base/atomic_file.h"
#include "kernels/maps/distance_map.h"
#include "tests/full_record.h"
#include "tests/temp_folder.h"
#include "tests/test_heightmap.h"
#include "tuner/measure/cached_values.h"
#include "tuner/measure/map_library.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

std::vector<std::byte> value_of(std::size_t bytes, int fill) { return {bytes, static_cast<std::byte>(fill)}; }

TEST(Cache, gives_back_what_was_put_and_nothing_damaged) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  EXPECT_FALSE(cache.get("a"));
  cache.put("a", value_of(100, 7));
  EXPECT_EQ(cache.get("a"), value_of(100, 7));
  EXPECT_FALSE(cache.get("b"));
  for (const auto& item : std::filesystem::directory_iterator(folder / "cache"))
    std::filesystem::resize_file(item.path(), std::filesystem::file_size(item.path()) - 1);
  EXPECT_FALSE(cache.get("a"));
}

TEST(Cache, what_is_not_the_keys_own_file_is_absent) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  cache.put("a", value_of(100, 1));
  cache.put("b", value_of(100, 2));
  std::filesystem::rename(cache.file("a"), folder / "aside");
  std::filesystem::rename(cache.file("b"), cache.file("a"));
  std::filesystem::rename(folder / "aside", cache.file("b"));
  EXPECT_FALSE(cache.get("a")) << "b's value";
  EXPECT_FALSE(cache.get("b")) << "a's value";
  std::filesystem::create_directories(cache.file("c"));
  EXPECT_FALSE(cache.get("c"));
  cache.put("c", value_of(100, 3));  // cannot be kept, and that is no error
  EXPECT_FALSE(cache.get("c"));
  cache.trim(0);
  EXPECT_TRUE(std::filesystem::is_directory(cache.file("c")));
}

// As when many machines share a folder: whoever reads finds the whole value of its key or nothing.
TEST(Cache, many_processes_write_at_once) {
  const TempFolder folder;
  constexpr int kProcesses = 4;
  constexpr int kKeys = 3;
  constexpr std::size_t kBytes = 200'000;
  std::vector<pid_t> children;
  for (int process = 0; process < kProcesses; ++process) {
    const pid_t child = fork();
    if (child != 0) {
      children.push_back(child);
      continue;
    }
    const Cache cache(folder / "cache");
    bool is_good = true;
    for (int round = 0; round < 40; ++round) {
      const int key = (process + round) % kKeys;
      const auto before = cache.get(std::to_string(key));
      is_good = is_good && (!before || *before == value_of(kBytes, key));
      cache.put(std::to_string(key), value_of(kBytes, key));
      if (round % 8 == process) cache.trim(kBytes);
      if (round % 8 == 7 - process) remove_stale_temporaries(folder / "cache");
    }
    _exit(is_good ? 0 : 1);
  }
  for (const pid_t child : children) {
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  for (const auto& item : std::filesystem::directory_iterator(folder / "cache"))
    EXPECT_EQ(item.path().extension(), ".bin") << "a temporary file that nobody removes";
}

TEST(CachedValues, come_back_to_the_bit) {
  const std::vector<float> values = {0, 0.1F, 1, 65504};
  const Codec<BakedValues> bakes = bake_codec(values.size());
  const std::optional<BakedValues> bake = bakes.read(bakes.write({.time_ns = 1234.5, .values = values}));
  ASSERT_TRUE(bake);
  EXPECT_EQ(bake->time_ns, 1234.5);
  EXPECT_EQ(bake->values, values);

  const std::vector<ReferenceHit> hits = {{.t_enter = 1.0 / 3, .t_exit = 0.5},
                                          {.t_enter = 0, .t_exit = std::numeric_limits<double>::infinity()}};
  const auto read = hits_codec(hits.size()).read(hits_codec(hits.size()).write(hits));
  ASSERT_TRUE(read);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    EXPECT_EQ((*read)[i].t_enter, hits[i].t_enter);
    EXPECT_EQ((*read)[i].t_exit, hits[i].t_exit);
  }

  FrameScore score = *full_record().error;
  score["e_xy.mean"] = 1.0 / 3;
  for (const bool has_optionals : {true, false}) {
    if (!has_optionals) score["psnr"] = score["flicker"] = std::nullopt;
    const auto known = score_codec().read(score_codec().write(score));
    ASSERT_TRUE(known);
    EXPECT_EQ(*known, score);
  }
}

TEST(CachedValues, of_before_a_metric_are_absent) {
  FrameScore score = full_score();
  score["taps.max"].reset();
  EXPECT_FALSE(score_codec().read(score_codec().write(score)));
}

TEST(CachedValues, of_another_size_or_kind_are_absent) {
  const std::vector<float> values(8, 0.5F);
  const std::vector<std::byte> bake = bake_codec(8).write({.time_ns = 1, .values = values});
  EXPECT_FALSE(bake_codec(7).read(bake));
  EXPECT_FALSE(bake_codec(9).read(bake));
  EXPECT_FALSE(hits_codec(4).read(bake));
  EXPECT_FALSE(score_codec().read(bake));
  EXPECT_FALSE(bake_codec(8).read(score_codec().write({})));
  EXPECT_FALSE(bake_codec(8).read({}));
  EXPECT_FALSE(score_codec().read({}));
  for (std::size_t size = 0; size < bake.size(); ++size)
    EXPECT_FALSE(bake_codec(8).read(std::span(bake).first(size))) << size;
  std::vector<std::byte> text = score_codec().write(full_score());
  text[text.size() - 2] = std::byte{'x'};
  EXPECT_FALSE(score_codec().read(text));
}

TEST(CachedValues, every_kind_bakes_as_many_as_are_expected) {
  const Heightfield heights = on_the_bottom(load_heightmap({.source = "fbm", .width = 12, .height = 7}));
  for (const MapRow& map : map_kinds()) {
    if (map.content == MapContent::heights) continue;
    std::vector<MapValue> parameters;
    if (map.kind == MapKind::distance) parameters.push_back({.param = kDistanceSlices.id, .value = 5});
    const BakeRequest request{
        .heights = heights, .correction = map.corrections.front(), .parameters = std::move(parameters)};
    EXPECT_EQ(map.bake(request).size(), baked_value_count(map, request)) << map.id;
  }
}

/// A value that is rightly signed for its key, and of another map's size.
TEST(CachedValues, a_library_bakes_again_what_does_not_fit) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  const SceneSpec scene{.id = "fbm/top", .heightmap = {.source = "fbm", .width = 16, .height = 16}, .scene = {}};
  const Settings cone = parse_setting("cone");
  WallSplit split;
  MapLibrary first(cache, split);
  const BakedMap good = first.map(cone, scene);
  EXPECT_EQ(first.baked(), 1);
  for (const std::size_t size : {0U, 1U, 255U, 257U}) {
    cache.put(good.key, bake_codec(size).write({.time_ns = 1, .values = std::vector<float>(size, 0.5F)}));
    MapLibrary again(cache, split);
    EXPECT_EQ(again.map(cone, scene).values, good.values);
    EXPECT_EQ(again.baked(), 1) << size;
  }
  MapLibrary kept(cache, split);
  EXPECT_EQ(kept.map(cone, scene).values, good.values);
  EXPECT_EQ(kept.from_cache(), 1);
}

TEST(Cache, trimming_keeps_what_was_used_last) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  for (const char* key : {"a", "b", "c", "d"}) {
    cache.put(key, value_of(1000, 1));
    for (const auto& item : std::filesystem::directory_iterator(folder / "cache"))
      std::filesystem::last_write_time(item.path(), item.last_write_time() - std::chrono::hours(1));
  }
  ASSERT_TRUE(cache.get("a"));
  const auto kept = [&] {
    std::string keys;
    for (const char* key : {"a", "b", "c", "d"}) keys += std::filesystem::exists(cache.file(key)) ? key : "";
    return keys;
  };
  cache.trim(10'000);
  EXPECT_EQ(kept(), "abcd");
  cache.trim(2 * 1100);
  EXPECT_EQ(kept(), "ad");
  cache.trim(0);
  EXPECT_EQ(kept(), "");
  Cache(folder / "nothing").trim(0);
}

TEST(Cache, trimming_leaves_files_that_are_not_its_own) {
  const TempFolder folder;
  for (const char* name : {"notes.txt", "data.bin"}) std::ofstream(folder / name) << "mine";
  Cache(folder.path()).trim(0);
  for (const char* name : {"notes.txt", "data.bin"}) EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
}

}  // namespace
}  // namespace reliefbench
