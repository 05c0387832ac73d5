// Where `tune` puts its run when nobody says where.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "kernels/image/image.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

/// "report: PAGE", where `tune` puts it by itself.
class TuneFolder : public ::testing::Test {
 protected:
  [[nodiscard]] std::string report(std::vector<std::string> more) const {
    more.insert(more.begin(), {"tune", "config.json", "--backend", "null", "--quiet"});
    const CommandResult result = run_reliefbench(more, folder_.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const std::size_t at = std::min(result.out.find("report: "), result.out.size());
    return result.out.substr(at, result.out.find('\n', at) - at);
  }
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

// Each question has a folder of its own, so that a command that was copied and changed is not refused.
TEST_F(TuneFolder, without_an_output_each_question_has_its_own_folder) {
  std::ofstream(folder_ / "config.json") << R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 32, "height": 32}, "views": ["oblique", "top"],
                "frame_px": [32, 32]}],
    "measure": {"samples": 3, "batch_ms": 0.5, "warmup_batches_max": 2, "control_every": 2, "block_cases": 4},
    "sweeps": [{"technique": "flat"},
               {"technique": "relief", "axes": {"linear_steps": {"from": 4, "to": 64, "times": 2}}}]})";
  const std::set<std::string> folders{report({}),
                                      report({"--scene", "top"}),
                                      report({"--max-error", "e_xy.p99<=100"}),
                                      report({"--epsilon", "0.05"}),
                                      report({"--relief-depth", "0.2"}),
                                      report({"--tiling", "2"}),
                                      report({"--wrap", "clamp"}),
                                      report({"--frame-px", "16x32"})};
  EXPECT_EQ(folders.size(), 8U);
  EXPECT_TRUE(folders.contains(report({})));  // asked again, it goes on in the same one
}

// The config says the same then, but what was measured is another run's, which its folder keeps out.
TEST_F(TuneFolder, without_an_output_a_file_that_changed_is_another_question) {
  const auto write_map = [&](int step) {
    std::vector<std::uint8_t> rgba8;
    for (int i = 0; i < 16 * 16 * 4; ++i) rgba8.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(i / 4 * step));
    write_png(folder_ / "map.png", 16, 16, rgba8);
  };
  static_cast<void>(null_sweep(folder_));
  ASSERT_EQ(run_reliefbench({"presets", "run", "-o", "presets.json"}, folder_.path()).exit_code, 0);
  std::ofstream(folder_ / "config.json") << R"({
    "scenes": [{"heightmap": "map.png", "views": "oblique", "frame_px": [16, 16]}], "measure": {"samples": 3},
    "sweeps": [{"presets": "presets.json"}, {"technique": "flat"}]})";
  write_map(1);
  const std::string first = report({});
  std::ofstream(folder_ / "presets.json", std::ios::app) << "\n";
  const std::string other_presets = report({});
  write_map(3);
  const std::string other_heights = report({});
  EXPECT_EQ((std::set{first, other_presets, other_heights}).size(), 3U);
  EXPECT_EQ(report({}), other_heights);
}

}  // namespace
}  // namespace reliefbench
