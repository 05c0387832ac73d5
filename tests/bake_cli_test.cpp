// `reliefbench bake` as a user meets it. Nothing is timed for its own sake, so these tests run beside others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "backends/backend.h"
#include "kernels/image/image.h"
#include "kernels/image/ktx2.h"
#include "tests/command.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class BakeCommand : public ::testing::Test {
 protected:
  [[nodiscard]] CommandResult bake(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "bake");
    return run_reliefbench(arguments, folder_.path());
  }
  /// One line on stderr with these words, this exit code.
  void expect_refused(const std::vector<std::string>& arguments, int exit_code, const std::string& words) const {
    const CommandResult result = bake(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  }
  /// A grey heightmap of bumps that differ.
  [[nodiscard]] std::string heightmap_file() const {
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 32 * 32; ++i) {
      const auto grey = static_cast<std::uint8_t>((i * i * 7 + i / 32 * 31) % 256);
      pixels.insert(pixels.end(), {grey, grey, grey, 255});
    }
    write_png(folder_ / "bumps.png", 32, 32, pixels);
    return "bumps.png";
  }

  TempFolder folder_;
};

TEST_F(BakeCommand, a_safe_map_is_proved) {
  for (const std::string correction : {"safe", "certified", "min4"}) {
    const CommandResult result =
        bake({heightmap_file(), "--map", "conservative", "--correction", correction, "--verify"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("1024 of 1024 proved, 0 broken, 0 undecided"));
    EXPECT_THAT(result.out, HasSubstr("holds"));
  }
}

TEST_F(BakeCommand, a_broken_guarantee_exits_1_and_names_the_factor) {
  const CommandResult result =
      bake({"checker", "--size", "32x32", "--map", "conservative", "--correction", "min3x3", "--verify"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1024 broken"));
  EXPECT_THAT(result.out, HasSubstr("up to 1.41"));
}

// No correction is no excuse: what is found broken is never said to hold.
TEST_F(BakeCommand, an_uncorrected_map_is_broken_between_its_texels) {
  const std::vector<std::string> map = {"fbm", "--size", "32x32", "--map", "conservative", "--correction", "none"};
  std::vector<std::string> verify = map;
  verify.emplace_back("--verify");
  const CommandResult text = bake(verify);
  EXPECT_EQ(text.exit_code, 1) << text.err;
  EXPECT_THAT(text.out, HasSubstr("0 of 1024 too wide"));
  EXPECT_THAT(text.out, ContainsRegex("[1-9][0-9]* broken, .*up to "));
  EXPECT_THAT(text.out, ContainsRegex("guarantee +broken between texels\n"));
  verify.emplace_back("--json");
  const CommandResult json = bake(verify);
  EXPECT_EQ(json.exit_code, 1);
  EXPECT_EQ(nlohmann::json::parse(json.out).at("verify").at("verdict"), "broken");
}

TEST_F(BakeCommand, the_published_quick_map_is_broken_by_default) {
  const CommandResult result = bake({"spikes", "--size", "128x128", "--map", "quick_published", "--verify"});
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("quick_published (none)"));
  EXPECT_THAT(result.out, ContainsRegex("[1-9][0-9]* of 16384 too wide, up to 1\\.[0-9]+ times"));
}

TEST_F(BakeCommand, maps_that_promise_nothing_break_nothing) {
  const CommandResult result = bake({"spikes", "--size", "32x32", "--map", "relaxed_po07", "--verify"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("cross twice"));
  EXPECT_THAT(result.out, HasSubstr("promises nothing"));
}

TEST_F(BakeCommand, a_devices_bake_says_where_its_time_went) {
  const std::vector<std::string> arguments = {"fbm", "--size", "32x32", "--map", "hybrid", "--device", "vulkan"};
  std::vector<std::string> as_json = arguments;
  as_json.insert(as_json.end(), {"--repeat", "3", "--json"});
  const auto json = nlohmann::json::parse(bake(as_json).out);
  EXPECT_EQ(json.at("device"), "vulkan");
  EXPECT_EQ(json.at("device_index"), 0);
  EXPECT_EQ(json.at("device_name"), vulkan_devices().front().name);
  EXPECT_EQ(json.at("driver"), vulkan_devices().front().driver);
  EXPECT_FALSE(json.contains("pack_ms"));
  EXPECT_EQ(json.at("device_clock").at("timer"), "vk_timestamp");
  // A busy machine may spoil the audit.
  EXPECT_EQ(json.contains("device_ms"), json.at("device_clock").at("valid").get<bool>());
  if (json.contains("device_ms")) {
    for (const char* part : {"upload", "pyramid", "search", "correction", "pack", "read_back"})
      EXPECT_GE(json.at("device_ms").at(part), 0) << part;
    EXPECT_EQ(json.at("device_ms").size(), 6U);
    EXPECT_GT(json.at("device_ms").at("search"), 0);
  }
  std::vector<std::string> as_blocks = arguments;
  as_blocks.insert(as_blocks.end(), {"--format", "bc5"});
  const std::string text = bake(as_blocks).out;
  EXPECT_THAT(text, ContainsRegex("\n(  search +[0-9]|its clock +vk_timestamp is not believed)"));
  EXPECT_THAT(text, ContainsRegex("\ndevice +vulkan 0: "));
  EXPECT_THAT(text, ContainsRegex("\npacked in +[0-9.]+ .s on cpu"));
  expect_refused({"fbm", "--map", "quick", "--repeat", "0"}, 2, "--repeat");
}

TEST_F(BakeCommand, json_has_all_figures) {
  const CommandResult result = bake({"fbm", "--size", "40x24", "--seed", "5", "--map", "conservative", "--wrap",
                                     "clamp", "--verify", "--json", "-o", "map.ktx2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("heightmap"), "fbm");
  EXPECT_EQ(json.at("map"), "conservative");
  EXPECT_EQ(json.at("correction"), "safe");
  EXPECT_EQ(json.at("encoding"), "sqrt");
  EXPECT_EQ(json.at("format"), "rg16");
  EXPECT_EQ(json.at("wrap"), "clamp");
  EXPECT_EQ(json.at("device"), "cpu");
  EXPECT_EQ(json.at("width"), 40);
  EXPECT_EQ(json.at("height"), 24);
  EXPECT_GT(json.at("time_ms"), 0);
  EXPECT_GT(json.at("mean_ratio"), 0);
  EXPECT_EQ(json.at("closed_share"), 0);
  EXPECT_EQ(json.at("bytes"), 40 * 24 * 4);
  EXPECT_EQ(json.at("verify").at("verdict"), "holds");
  EXPECT_EQ(json.at("verify").at("texels_too_wide"), 0);
  EXPECT_EQ(json.at("verify").at("cells").at("proved"), 39 * 23);
  EXPECT_EQ(json.at("files"), nlohmann::json::array({"map.ktx2"}));
}

TEST_F(BakeCommand, files_hold_the_map_and_say_what_it_is) {
  ASSERT_EQ(bake({"bricks", "--size", "32x16", "--map", "conservative", "--correction", "certified", "--encoding",
                  "ratio", "--format", "rg16f", "-o", "map.ktx2"})
                .exit_code,
            0);
  const Ktx2File file = read_ktx2(folder_ / "map.ktx2");
  EXPECT_EQ(file.image.width, 32);
  EXPECT_EQ(file.image.height, 16);
  EXPECT_EQ(file.image.layout, (TexelLayout{.type = TexelType::float16, .channels = 2}));
  EXPECT_THAT(file.metadata.at("KTXwriter"), HasSubstr("reliefbench "));
  EXPECT_EQ(file.metadata.at("reliefbench.kind"), "conservative");
  EXPECT_EQ(file.metadata.at("reliefbench.correction"), "certified");
  EXPECT_EQ(file.metadata.at("reliefbench.encoding"), "ratio");
  EXPECT_EQ(file.metadata.at("reliefbench.format"), "rg16f");
  EXPECT_EQ(file.metadata.at("reliefbench.wrap"), "repeat");
  EXPECT_EQ(file.metadata.at("reliefbench.relief_range"), "0 1");

  const std::vector<std::string> map{"bricks", "--size", "32x16", "--map", "conservative", "-o"};
  for (const std::string name : {"map.exr", "map.png"}) {
    std::vector<std::string> arguments = map;
    arguments.push_back(name);
    const CommandResult result = bake(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(load_image(folder_ / name).channels.size(), 2U);
  }
  const CommandResult heights = bake({"bricks", "--size", "32x16", "--map", "height", "-o", "heights.png"});
  EXPECT_EQ(heights.exit_code, 0) << heights.err;
  EXPECT_THAT(heights.out, Not(HasSubstr("mean ratio")));
  EXPECT_EQ(load_image(folder_ / "heights.png").channels.size(), 1U);
}

TEST_F(BakeCommand, what_makes_no_sense_is_refused_with_the_reason) {
  const std::vector<std::string> start{"checker", "--size", "8x8", "--map"};
  const auto refused = [&](const std::vector<std::string>& rest, int exit_code, const std::string& words) {
    std::vector<std::string> arguments = start;
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    expect_refused(arguments, exit_code, words);
  };
  refused({"conic"}, 2, "map kind 'conic' is unknown");
  refused({"conservative", "--correction", "maximal"}, 2, "correction 'maximal' is unknown");
  refused({"relaxed_po07", "--correction", "safe"}, 2, "a relaxed_po07 map has no correction safe");
  refused({"conservative", "--format", "r16"}, 2, "format r16 has room for 0 cone ratios");
  refused({"conservative", "--format", "rg16", "--max-ratio", "unbounded"}, 2, "cannot hold a ratio over 1");
  refused({"conservative", "--max-ratio", "2"}, 2, "--max-ratio 2: expected one of 1, unbounded");
  refused({"conservative", "--encoding", "h_tan", "--correction", "certified"}, 2, "interpolates radii");
  refused({"conservative", "--search-steps", "64"}, 2, "has no such parameter");
  refused({"conservative", "--wrap", "mirror"}, 2, "wrap 'mirror' is unknown (known: repeat, clamp)");
  refused({"conservative", "--device", "metal"}, 2, "--device metal");
  for (const char* device : {"vulkan:", "vulkan:x", "vulkan:-1", "vulkan:1x", "cpu:0"})
    refused({"conservative", "--device", device}, 2, std::string("--device ") + device);
  refused({"conservative", "--device", "vulkan:99"}, 3, "no device 99");
  refused({"height", "--verify"}, 2, "a height map has no cones to verify");
  refused({"conservative", "-o", "map.dds"}, 2, ".ktx2, .exr or .png");
  refused({"conservative", "-o", "none/map.ktx2"}, 2, "none/map.ktx2: cannot be written");
  expect_refused({"missing.png", "--map", "conservative"}, 2, "missing.png");
  expect_refused({"checker"}, 2, "--map");
  expect_refused({"checker", "--map", "conservative", "--size", "8by8"}, 2, "expected WIDTHxHEIGHT");
}

TEST_F(BakeCommand, an_unbounded_ratio_chooses_floats) {
  const CommandResult result =
      bake({"spikes", "--size", "32x32", "--map", "conservative", "--max-ratio", "unbounded", "--verify", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("format"), "rg16f");
  EXPECT_EQ(nlohmann::json::parse(result.out).at("verify").at("verdict"), "holds");
}

}  // namespace
}  // namespace reliefbench
