// Rooms include only what the table below lets them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace reliefbench {
namespace {

const std::filesystem::path kRoot = RELIEFBENCH_SOURCE_DIR;

bool is_source(const std::filesystem::path& path) { return path.extension() == ".h" || path.extension() == ".cpp"; }

std::vector<std::filesystem::path> sources_of(const std::string& module) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kRoot / module))
    if (is_source(entry.path())) files.push_back(entry.path());
  return files;
}

std::vector<std::string> includes_of(const std::filesystem::path& file) {
  std::vector<std::string> includes;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("#include ")) includes.push_back(line.substr(10, line.find_last_of(">\"") - 10));
  return includes;
}

/// A top folder's rooms, from top floor to ground; rooms of one floor stand side by side. A room may include rooms of
/// lower floors, and what its top folder may.
struct Top {
  std::string id;
  std::vector<std::vector<std::string>> floors;  ///< "" is the top folder itself
  std::set<std::string> may_include;             ///< other top folders, all of their rooms
};

const std::vector<Top> kTops = {
    {"reports", {{"export", "pages", "viewer"}}, {"kernels", "backends", "tuner"}},
    {"tuner",
     {{"cli"}, {"tune"}, {"measure"}, {"decide"}, {"history"}, {"results"}, {"plan"}, {"search"}},
     {"kernels", "backends"}},
    {"backends", {{"window", "worker"}, {"opengl", "vulkan"}, {""}}, {"kernels"}},
    {"kernels", {{"trace"}, {"maps"}, {"judge"}, {"image", "mesh"}, {"base"}}, {}}};

/// Where a file of the project stands: its top folder and its room.
std::pair<std::string, std::string> place_of(const std::string& file) {
  const std::filesystem::path path(file);
  const std::filesystem::path folder = path.parent_path();
  const std::string top = folder.begin()->string();
  return {top, folder == top ? "" : folder.filename().string()};
}

/// Number of a room's floor, 0 on top; nothing where the table has no such room.
std::optional<std::size_t> floor_of(const Top& top, const std::string& room) {
  for (std::size_t i = 0; i < top.floors.size(); ++i)
    if (std::ranges::find(top.floors[i], room) != top.floors[i].end()) return i;
  return std::nullopt;
}

/// The rooms as README draws them.
std::string picture() {
  std::string text;
  for (const Top& top : kTops) {
    std::string line;
    for (const auto& floor : top.floors) {
      std::string rooms;
      for (const std::string& room : floor)
        rooms += (rooms.empty() ? "" : " | ") + (room.empty() ? std::string("(interface)") : room);
      line += (line.empty() ? "" : " > ") + rooms;
    }
    text += fmt::format("{:<10} {}\n", top.id + "/", line);
  }
  return text;
}

TEST(LayeringTest, no_arrow_runs_back) {
  for (const Top& top : kTops) {
    for (const auto& file : sources_of(top.id)) {
      const std::string own = file.lexically_relative(kRoot).string();
      const auto floor = floor_of(top, place_of(own).second);
      ASSERT_TRUE(floor) << own << " stands in no room of the table";
      for (const std::string& include : includes_of(file)) {
        const auto [other, room] = place_of(include);
        const auto known = std::ranges::find(kTops, other, &Top::id);
        if (known == kTops.end()) continue;
        const bool is_cli = place_of(own) == std::pair<std::string, std::string>("tuner", "cli");
        if (other != top.id) {
          EXPECT_TRUE(top.may_include.contains(other) || (is_cli && other == "reports")) << own << " -> " << include;
          EXPECT_FALSE(other == "tuner" && room == "cli") << own << " -> " << include;
        } else if (room != place_of(own).second) {
          const auto below = floor_of(top, room);
          ASSERT_TRUE(below) << own << " -> " << include;
          EXPECT_GT(*below, *floor) << own << " -> " << include;
        }
      }
    }
  }
}

TEST(LayeringTest, every_room_of_the_table_holds_something) {
  for (const Top& top : kTops) {
    std::set<std::string> seen;
    for (const auto& file : sources_of(top.id)) seen.insert(place_of(file.lexically_relative(kRoot).string()).second);
    for (const auto& floor : top.floors)
      for (const std::string& room : floor) EXPECT_TRUE(seen.contains(room)) << top.id << '/' << room;
  }
}

TEST(LayeringTest, readme_draws_the_rooms) {
  std::ifstream in(kRoot / "README.md");
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_NE(text.find("```text\n" + picture() + "```"), std::string::npos) << picture();
}

TEST(LayeringTest, graphics_headers_stay_in_the_backends) {
  for (const std::string module : {"kernels", "tuner", "reports"}) {
    for (const auto& file : sources_of(module)) {
      for (const std::string& include : includes_of(file)) {
        for (const char* api : {"epoxy", "EGL/", "GL/", "vulkan", "volk", "GLFW", "glslang", "SPIRV"})
          EXPECT_FALSE(include.starts_with(api)) << file << " includes " << include;
      }
    }
  }
}

TEST(LayeringTest, only_one_shader_file_knows_the_api) {
  for (const auto& entry : std::filesystem::directory_iterator(kRoot / "kernels/shaders")) {
    std::ifstream in(entry.path());
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    EXPECT_EQ(text.find("VULKAN") != std::string::npos, entry.path().filename() == "platform.glsl") << entry.path();
  }
}

}  // namespace
}  // namespace reliefbench
