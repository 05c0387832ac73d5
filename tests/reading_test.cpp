// How a heightmap is read is asked for and told alike in every command that takes one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/command.h"
#include "tests/image_files.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

class Reading : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult run(const std::vector<std::string>& arguments) const {
    return run_reliefbench(arguments, folder_.path());
  }
  /// Heights 0 to 1, with a mask that differs from them.
  void write_masked() const {
    std::vector<float> pixels;
    for (int i = 0; i < 16 * 16; ++i) {
      pixels.push_back(static_cast<float>(i) / 255.0F);
      pixels.push_back(i % 3 == 0 ? 0.0F : 1.0F);
    }
    write_image(folder_ / "rocks.png", {16, 16, 2, TexelType::unorm16, pixels});
  }

  TempFolder folder_;
};

TEST_F(Reading, every_command_that_takes_a_heightmap_has_the_options) {
  for (const std::string command : {"bake", "export", "view", "tune"})
    for (const std::string option : {"--channel", "--invert", "--normalise"})
      EXPECT_THAT(run({command, "--help"}).out, HasSubstr(option)) << command;
}

TEST_F(Reading, says_what_was_read) {
  write_masked();
  const CommandResult grey = run({"bake", "./rocks.png", "--map", "height", "-o", "grey.ktx2"});
  EXPECT_EQ(grey.exit_code, 0) << grey.err;
  EXPECT_EQ(grey.err, "read ./rocks.png: 16x16, 16-bit grey (alpha ignored)\n");
  const CommandResult mask = run({"bake", "./rocks.png", "--map", "height", "--channel", "a", "-o", "mask.ktx2"});
  EXPECT_EQ(mask.err, "read ./rocks.png: 16x16, 16-bit alpha (Y ignored)\n");
  const CommandResult low = run({"bake", "./rocks.png", "--map", "height", "--invert", "-o", "low.ktx2"});
  EXPECT_EQ(low.err, "read ./rocks.png: 16x16, 16-bit grey (alpha ignored), inverted\n");
  EXPECT_NE(read_bytes(folder_ / "grey.ktx2"), read_bytes(folder_ / "mask.ktx2"));
  EXPECT_NE(read_bytes(folder_ / "grey.ktx2"), read_bytes(folder_ / "low.ktx2"));
  EXPECT_EQ(run({"bake", "fbm", "--size", "16x16", "--map", "height"}).err, "");
}

TEST_F(Reading, export_ships_the_heights_that_were_asked_for) {
  write_masked();
  const auto exported = [&](const std::string& folder, std::vector<std::string> reading) {
    reading.insert(reading.begin(), {"export", "./rocks.png", "--case", "relief?format=r16", "-o", folder});
    const CommandResult result = run(reading);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_EQ(exported("as_is", {}), "read ./rocks.png: 16x16, 16-bit grey (alpha ignored)\n");
  EXPECT_THAT(exported("inverted", {"--invert"}), EndsWith("(alpha ignored), inverted\n"));
  EXPECT_NE(read_bytes(folder_ / "as_is/relief.ktx2"), read_bytes(folder_ / "inverted/relief.ktx2"));
}

TEST_F(Reading, tune_reads_its_hold_outs_as_what_it_tunes_on) {
  write_masked();
  std::filesystem::copy_file(folder_ / "rocks.png", folder_ / "held.png");
  const CommandResult result = run({"tune", "./rocks.png", "--invert", "--holdout", "./held.png", "--frame-px", "32x32",
                                    "--backend", "null", "--time-limit", "0.001s", "-o", "run"});
  EXPECT_EQ(result.exit_code, 2);  // for it is the same: read as it was, it has the same heights
  EXPECT_THAT(result.err, HasSubstr("--holdout ./held.png: is what the pick is tuned on"));
}

TEST_F(Reading, an_unknown_channel_is_refused) {
  write_masked();
  const CommandResult result = run({"bake", "./rocks.png", "--map", "height", "--channel", "depth"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--channel: depth not in {auto,r,g,b,a,luminance}"));
}

}  // namespace
}  // namespace reliefbench
