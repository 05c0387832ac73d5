// The viewer's window under Xvfb, driven by scripts, on both backends against the same pictures.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "backends/backend.h"
#include "backends/window/screen.h"
#include "kernels/image/image.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tuner/decide/presets.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kRoot = RELIEFBENCH_SOURCE_DIR;

/// How two screenshots differ. Two rasterisers round a pixel's place on an edge apart: a golden may differ in so many
/// pixels by more than kFarApart of 1 in some channel.
struct Difference {
  double mean = 0;       ///< of all channels, 0 to 1
  double far_share = 0;  ///< of pixels
};
constexpr double kFarApart = 0.1;
constexpr double kFarShareMost = 0.02;
constexpr double kMeanMost = 0.005;

Difference difference(const Image& a, const Image& b) {
  Difference result;
  const std::size_t channels = a.channels.size();
  std::size_t far = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += channels) {
    double most = 0;
    for (std::size_t c = 0; c < channels; ++c) {
      const double apart = std::abs(static_cast<double>(a.pixels[i + c]) - static_cast<double>(b.pixels[i + c]));
      result.mean += apart;
      most = std::max(most, apart);
    }
    if (most > kFarApart) ++far;
  }
  result.mean /= static_cast<double>(a.pixels.size());
  result.far_share = static_cast<double>(far * channels) / static_cast<double>(a.pixels.size());
  return result;
}

DeviceInfo called(const std::string& name, int index = 0) {
  DeviceInfo device;
  device.name = name;
  device.index = index;
  return device;
}

TEST(WindowsDevice, is_known_by_its_name_where_no_other_has_it) {
  const std::vector<DeviceInfo> devices{called("GPU", 0), called("GPU", 1), called("llvmpipe", 2)};
  EXPECT_TRUE(is_windows_own(devices, 2, called("llvmpipe")));
  EXPECT_FALSE(is_windows_own(devices, 2, called("GPU")));
  EXPECT_FALSE(is_windows_own(devices, 1, called("GPU")));  // the window may be the other's
  EXPECT_FALSE(is_windows_own(devices, 0, called("GPU")));
  EXPECT_FALSE(is_windows_own(devices, 3, called("llvmpipe")));
}

class ViewWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v xvfb-run >/dev/null") != 0)  // NOLINT(concurrency-mt-unsafe)
      GTEST_SKIP() << "xvfb-run is not installed (apt-get install xvfb xauth)";
  }
  /// `view` with these arguments, in the folder.
  [[nodiscard]] CommandResult view(const std::string& arguments) const {
    const std::string command = fmt::format(
        "cd '{}' && RELIEFBENCH_CACHE=cache ASAN_OPTIONS={} timeout 240 xvfb-run -a -s '-screen 0 1280x800x24' '{}' "
        "view "
        "{} >out.txt 2>err.txt",
        folder_.path().string(), kChildAsanOptions, RELIEFBENCH_BINARY, arguments);
    const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe)
    return {
        .exit_code = WEXITSTATUS(status), .out = file_text(folder_ / "out.txt"), .err = file_text(folder_ / "err.txt")};
  }
  /// As the golden of that name. What was seen stays in build/screenshots, for people; with
  /// RELIEFBENCH_UPDATE_GOLDENS it becomes the golden.
  void expect_golden(const std::string& name, const std::string& backend) const {
    const std::filesystem::path seen = folder_ / (name + ".png");
    ASSERT_TRUE(std::filesystem::exists(seen)) << name;
    const std::filesystem::path golden = kRoot / "tests/goldens" / ("view_" + name + ".png");
    const std::filesystem::path kept = kRoot / "build/screenshots";
    const auto replace = std::filesystem::copy_options::overwrite_existing;
    std::filesystem::create_directories(kept);
    std::filesystem::copy_file(seen, kept / fmt::format("view_{}_{}.png", name, backend), replace);
    if (std::getenv("RELIEFBENCH_UPDATE_GOLDENS") != nullptr)  // NOLINT(concurrency-mt-unsafe)
      std::filesystem::copy_file(seen, golden, replace);
    const Image expected = load_image(golden);
    const Image found = load_image(seen);
    ASSERT_EQ(found.width, expected.width);
    ASSERT_EQ(found.height, expected.height);
    ASSERT_EQ(found.channels, expected.channels);
    const Difference apart = difference(found, expected);
    EXPECT_LT(apart.far_share, kFarShareMost) << name << " on " << backend << ": see " << kept;
    EXPECT_LT(apart.mean, kMeanMost) << name << " on " << backend << ": see " << kept;
  }
  TempFolder folder_;
};

class ViewWindowOn : public ViewWindow, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    ViewWindow::SetUp();
    if (find_backend(GetParam()).devices().empty()) GTEST_SKIP() << "no device of " << GetParam();
  }
};

TEST_P(ViewWindowOn, the_tour_looks_as_it_should_and_the_api_is_silent) {
  const CommandResult result = view(fmt::format("fbm --size 64x64 --size-px 320,240 --debug --backend {} --script '{}'",
                                                GetParam(), (kRoot / "tests/view/tour.txt").string()));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  for (const char* name : {"tour_error", "tour_taps", "tour_missed", "tour_help"}) expect_golden(name, GetParam());
  EXPECT_THAT(file_text(folder_ / "tour_case.txt"), HasSubstr(fmt::format("relief@fbm_64x64/grazing?linear_steps=6&")));
  EXPECT_EQ(parse_presets(file_text(folder_ / "tour_presets.json"), "tour_presets.json").size(), 1U);
}

TEST(ViewGoldens, pictures_of_other_things_are_told_apart) {
  const auto golden = [](const std::string& name) { return load_image(kRoot / "tests/goldens" / name); };
  const Image error = golden("view_tour_error.png");
  for (const char* other : {"view_tour_taps.png", "view_tour_missed.png"}) {
    const Difference apart = difference(error, golden(other));
    EXPECT_GT(apart.far_share, 5 * kFarShareMost) << other;
    EXPECT_GT(apart.mean, 5 * kMeanMost) << other;
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, ViewWindowOn, ::testing::Values("opengl", "vulkan"));

TEST_F(ViewWindow, presets_and_a_runs_front_are_at_hand_also_of_a_device_that_has_no_windows) {
  const std::vector<reliefbench::Run> runs = {load_run(null_sweep(folder_))};
  const auto presets = presets_json(make_presets(runs, {}));
  std::ofstream(folder_ / "presets.json") << presets.dump(1);
  const std::vector<LoadedPreset> loaded = parse_presets(presets.dump(), "presets.json");
  std::ofstream(folder_ / "script.txt") << fmt::format(
      "close times\nlevel 0\nwait\nlevel {}\nscreenshot level\ncopy case case.txt\n", loaded.back().quality);
  const CommandResult levels = view("fbm --size 32x32 --presets presets.json --quality 50 --script script.txt");
  ASSERT_EQ(levels.exit_code, 0) << levels.err;
  EXPECT_EQ(file_text(folder_ / "case.txt"),
            (Case{.settings = loaded.back().settings, .scene_id = "fbm_32x32/oblique", .backend = "null"}).id() + "\n");
  std::ofstream(folder_ / "script.txt") << "close times\npoint 2\nscreenshot front\ncopy case case.txt\nframes 3\n";
  const CommandResult front = view("run --script script.txt");
  ASSERT_EQ(front.exit_code, 0) << front.err;
  EXPECT_THAT(front.out, HasSubstr("3 frames at rest: "));
  EXPECT_THAT(file_text(folder_ / "case.txt"), HasSubstr("@fbm_32x32/oblique?"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "front.png"));
}

TEST_F(ViewWindow, frames_are_counted) {
  const CommandResult result = view("fbm --size 32x32 --size-px 96,64 --frames 3");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("3 frames while turning: "));
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace reliefbench
