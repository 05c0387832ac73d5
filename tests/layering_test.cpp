// A module includes only what the table below lets it, which is what it may link (CMakeLists.txt).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
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

TEST(LayeringTest, modules_include_only_what_they_may) {
  const std::set<std::string> modules = {"kernels", "backends", "tuner", "reports"};
  const std::map<std::string, std::set<std::string>> allowed = {{"kernels", {"kernels"}},
                                                                {"backends", {"kernels", "backends"}},
                                                                {"tuner", {"kernels", "backends", "tuner"}},
                                                                {"reports", {"kernels", "tuner", "reports"}}};
  for (const auto& [module, may] : allowed) {
    for (const auto& file : sources_of(module)) {
      const bool is_cli = file.parent_path().filename() == "cli";
      for (const std::string& include : includes_of(file)) {
        const std::string other = include.substr(0, include.find('/'));
        if (!modules.contains(other)) continue;
        EXPECT_TRUE(may.contains(other) || (is_cli && other == "reports")) << file << " includes " << include;
        EXPECT_TRUE(is_cli || !include.starts_with("tuner/cli/")) << file << " includes " << include;
      }
    }
  }
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
