// The commands of README.md and of the folders' README.md, run as they stand, but for what takes long: its quickstart
// is the smoke config, tune has a sixth of the time that it is given there, and one technique is put under stress.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "kernels/base/paper.h"
#include "tests/command.h"
#include "tests/temp_folder.h"
#include "tuner/plan/config.h"
#include "tuner/plan/plan.h"

namespace reliefbench {
namespace {

const std::filesystem::path kRoot = RELIEFBENCH_SOURCE_DIR;

/// All README.md as one text, in the order in which their commands run.
std::string readme_text() {
  std::string text;
  for (const char* folder : {"", "configs", "tuner", "kernels"}) text += file_text(kRoot / folder / "README.md");
  return text;
}

/// The lines of the ```sh blocks.
std::vector<std::string> readme_commands() {
  std::istringstream in(readme_text());
  std::vector<std::string> commands;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line == "```sh") {
      inside = true;
    } else if (line == "```") {
      inside = false;
    } else if (inside) {
      commands.push_back(line);
    }
  }
  return commands;
}

std::string in_less_time(std::string command) {
  for (const auto& [written, shorter] : {std::pair{"--time-limit 30s", "--time-limit 5s"},
                                         std::pair{"--filter '*/cliff'", "--filter 'relaxed_cone/*/cliff'"}}) {
    const std::size_t at = command.find(written);
    if (at != std::string::npos) command.replace(at, std::strlen(written), shorter);
  }
  return command;
}

TEST(ReadmeAudit, its_commands_run) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "configs");
  std::filesystem::create_directories(folder / "build/release");
  std::filesystem::copy_file(kRoot / "configs/smoke.json", folder / "configs/quickstart.json");
  std::filesystem::create_directories(folder / "configs/scenes");
  std::string scene = file_text(kRoot / "configs/scenes/floor.json");  // in small frames, and of shadows alone
  scene.replace(scene.find("[256, 256]"), 10, "[48, 48]");
  scene.replace(scene.find("\"visible\""), 0, R"("features": {"lod": [], "fade": [], "normals": []}, )");
  std::ofstream(folder / "configs/scenes/floor.json") << scene;
  std::filesystem::create_symlink(RELIEFBENCH_BINARY, folder / "build/release/reliefbench");
  std::filesystem::create_directories(folder / "tests");
  std::filesystem::create_directory_symlink(kRoot / "tests/data", folder / "tests/data");
  const std::vector<std::string> commands = readme_commands();
  ASSERT_GE(commands.size(), 8U);
  for (const std::string& command : commands) {
    const std::string line = "cd '" + folder.path().string() +
                             "' && RELIEFBENCH_CACHE=cache ASAN_OPTIONS=" + kChildAsanOptions + " " +
                             in_less_time(command) + " >out.txt 2>err.txt";
    const int status = std::system(line.c_str());  // NOLINT(concurrency-mt-unsafe)
    // Two real runs may differ, and three samples may not tell: any of compare's answers is an answer.
    const bool is_compare = command.find(" compare ") != std::string::npos;
    const bool is_tune = command.find(" tune ") != std::string::npos;  // a busy machine may leave it short of its aim
    const int exit_code = WEXITSTATUS(status);
    const bool is_require = command.find(" require ") != std::string::npos;  // small frames may be seen
    EXPECT_TRUE(exit_code == 0 || ((is_compare || is_require) && exit_code == 1) ||
                ((is_compare || is_tune) && exit_code == 4))
        << command << "\n"
        << file_text(folder / "out.txt") << file_text(folder / "err.txt");
  }
}

TEST(ReadmeTest, has_every_command_in_its_table_and_under_a_heading) {
  const std::string table = file_text(kRoot / "README.md");
  const std::string headings = file_text(kRoot / "tuner/README.md");
  const TempFolder folder;
  for (const std::string& name : command_names(folder.path())) {
    EXPECT_NE(table.find(fmt::format("| [`{0}`](tuner/README.md#{0}) |", name)), std::string::npos) << name;
    EXPECT_NE(headings.find("\n## " + name + "\n"), std::string::npos) << name;
  }
}

TEST(ReadmeTest, links_to_what_is_there) {
  static const std::regex link("\\]\\(([^)#:]+)(#[^)]*)?\\)");
  std::size_t links = 0;
  for (const char* folder : {"", "configs", "tuner", "kernels"}) {
    const std::string text = file_text(kRoot / folder / "README.md");
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at, ++links)
      EXPECT_TRUE(std::filesystem::exists(kRoot / folder / (*at)[1].str())) << folder << ": " << at->str();
  }
  EXPECT_GE(links, 20U);
}

TEST(ReadmeTest, counts_the_settings_that_tune_searches) {
  const std::vector<std::string> one{"vulkan"};
  const std::size_t settings = make_plan(load_config(kRoot / "configs/exhaustive.json"), one, "").cases.size();
  const std::string counted = fmt::format("{},{:03} settings", settings / 1000, settings % 1000);
  for (const char* folder : {"", "tuner"})
    EXPECT_NE(file_text(kRoot / folder / "README.md").find(counted), std::string::npos) << counted;
}

TEST(ReadmeTest, lists_the_papers_that_the_sources_cite) {
  std::vector<std::string> listed;
  std::ifstream in(kRoot / "kernels/README.md");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("- [")) listed.push_back(line);
  std::vector<std::string> known;
  for (const Paper& paper : papers())
    known.push_back(fmt::format("- [{}] {}{}*{}*, {}", paper.id, paper.authors, paper.authors.empty() ? "" : ": ",
                                paper.title, paper.where));
  EXPECT_EQ(listed, known);
}

}  // namespace
}  // namespace reliefbench
