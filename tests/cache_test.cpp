#include "tuner/measure/cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/temp_folder.h"

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
