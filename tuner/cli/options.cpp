#include "tuner/cli/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "backends/worker/remote.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

/// "WIDTHxHEIGHT" or a name of kFrameSizes. throws: Error(bad_input)
Size parse_frame_px(const std::string& text) {
  if (const FrameSize* size = find_frame_size(text)) return {size->width_px, size->height_px};
  const Size size = parse_size(text, "--frame-px", "pixels");
  for (const int side : {size.width, size.height})
    if (side < 1 || side > kFrameSideMax_px)
      fail_input("--frame-px: {} is out of range: a side has 1 to {} pixels", side, kFrameSideMax_px);
  return size;
}

}  // namespace

std::optional<double> finite_number(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || parsed != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

CLI::Validator expect_number(const std::string& what, const std::function<bool(double)>& holds,
                             const std::string& name) {
  return {[what, holds](const std::string& text) {
            const std::optional<double> value = finite_number(text);
            return value && holds(*value) ? std::string() : fmt::format("'{}': expected {}", text, what);
          },
          name};
}

CLI::Validator above_zero() {
  return expect_number(
      "a number above 0", [](double value) { return value > 0; }, "POSITIVE");
}

CLI::Validator not_below_zero() {
  return expect_number(
      "a number of at least 0", [](double value) { return value >= 0; }, "NONNEGATIVE");
}

CLI::Option* take_each(CLI::Option* list) { return list->expected(1)->allow_extra_args(false)->take_all(); }

void add_weights_option(CLI::App& command, std::vector<double>& weights, const std::string& words) {
  const auto read = [&weights](const std::string& text) {
    std::istringstream list(text + ',');  // so that an empty last one is one, too
    for (std::string weight; std::getline(list, weight, ',');) {
      const std::optional<double> value = finite_number(weight);
      if (!value || *value <= 0) fail_input("--weights '{}': expected a number above 0", weight);
      weights.push_back(*value);
    }
  };
  command.add_option_function<std::string>("--weights", read, words)->type_name("W,...");
}

CLI::Option* add_json_option(CLI::App& command, bool& json) { return command.add_flag("--json", json, "as JSON"); }

void add_quiet_option(CLI::App& command, bool& quiet) { command.add_flag("--quiet", quiet, "no progress"); }

void add_device_option(CLI::App& command, int& device) {
  command.add_option("--device", device, "index on the backend")->capture_default_str();
}

void add_channel_options(CLI::App& command, ReadingArguments& arguments) {
  const std::vector<std::string> channels(heightmap_channels().begin(), heightmap_channels().end());
  command
      .add_option("--channel", arguments.channel,
                  fmt::format("of the heightmap's file: {}; default: auto", fmt::join(channels, " | ")))
      ->check(CLI::IsMember(channels));
  const std::vector<std::string> floors(floor_channels().begin(), floor_channels().end());
  command
      .add_option(
          "--floor", arguments.floor,
          fmt::format("channel of a solid's lower surface: {}; default: none, a relief", fmt::join(floors, " | ")))
      ->check(CLI::IsMember(floors));
  command.add_flag("--invert", arguments.invert, "the heightmap holds depths: white is low");
  command.add_flag("--normalise", arguments.normalise, "stretch the heights to the whole of 0 to 1");
}

void add_reading_options(CLI::App& command, ReadingArguments& arguments) {
  add_channel_options(command, arguments);
  command.add_option("--size", arguments.size, "WIDTHxHEIGHT of a procedural heightmap; default: 256x256");
  command.add_option("--seed", arguments.seed, "of a procedural heightmap; default: 1");
}

void set_reading(HeightmapSpec& spec, const ReadingArguments& arguments) {
  if (arguments.channel) spec.channel = *arguments.channel;
  if (arguments.floor) spec.floor = *arguments.floor;
  spec.invert = spec.invert || arguments.invert;
  spec.normalise = spec.normalise || arguments.normalise;
  if (!arguments.size.empty()) set_size(spec, arguments.size);
  if (arguments.seed) spec.seed = *arguments.seed;
}

void print_reading(const std::string& reading) {
  if (!reading.empty()) write_stderr(fmt::format("read {}\n", one_line(reading)));
}

void add_base_option(CLI::App& command, std::optional<double>& base, const std::string& usual) {
  command
      .add_option("--base", base,
                  "height of the relief that lies in the polygon's plane: 1, the relief goes down from there; 0, up; "
                  "default: " +
                      usual)
      ->check(CLI::Range(0.0, 1.0));
}

Size parse_size(const std::string& text, std::string_view option, std::string_view unit) {
  Size size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  const bool has_height = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_height ? std::from_chars(width.ptr + 1, end, size.height) : width;
  if (!has_height || height.ec != std::errc() || height.ptr != end)
    fail_input("{} {}: expected WIDTHxHEIGHT in {}, as in 256x256", option, text, unit);
  return size;
}

std::vector<DeviceInfo> chosen_devices(std::span<const std::string> backend_ids, int index) {
  std::vector<DeviceInfo> chosen;
  for (const std::string& id : backend_ids)
    for (const DeviceInfo& device : isolated_devices(find_backend(id)))
      if (device.index == index) chosen.push_back(device);
  return chosen;
}

void add_frame_option(CLI::App& command, std::optional<Size>& frame_px, std::string_view otherwise) {
  std::vector<std::string_view> sizes(kFrameSizes.size());
  std::ranges::transform(kFrameSizes, sizes.begin(), &FrameSize::id);
  const std::string usual = fmt::format("the scene's, else 1080p on hardware, {}x{} on software rasterisers",
                                        Scene{}.width_px, Scene{}.height_px);
  const std::string words = fmt::format("WIDTHxHEIGHT of all frames, or {}; default: {}", fmt::join(sizes, " | "),
                                        otherwise.empty() ? usual : otherwise);
  const auto read = [&frame_px](const std::string& text) { frame_px = parse_frame_px(text); };
  command.add_option_function<std::string>("--frame-px", read, words)->type_name("WxH");
}

void add_slowdown_option(CLI::App& command, Slowdowns& slowdowns) {
  const auto read = [&slowdowns](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      const std::size_t colon = text.find(':');
      const std::optional<double> factor =
          colon == std::string::npos ? std::nullopt : finite_number(std::string_view(text).substr(colon + 1));
      if (!factor || *factor <= 0)
        fail_input("--inject-slowdown {}: expected TECHNIQUE:FACTOR, as in relaxed_cone:1.1", text);
      slowdowns[std::string(find_technique(text.substr(0, colon)).id)] = *factor;
    }
    return true;
  };
  command
      .add_option("--inject-slowdown", read,
                  "multiply a technique's times, to see that it is found; the run says so; may be repeated")
      ->type_name("TECHNIQUE:FACTOR")
      ->take_all();
}

void fail_scene(const std::string& scene, const std::set<std::string>& known, std::string_view owner,
                bool are_several) {
  fail_input("--scene {}: {} {} no such scene ({} {})", scene, owner, are_several ? "have" : "has",
             are_several ? "they have" : "it has", fmt::join(known, ", "));
}

std::set<std::string> scenes_of(std::span<const Record> records) {
  std::set<std::string> known;
  for (const Record& record : records) known.insert(record.scene);
  return known;
}

void set_size(HeightmapSpec& spec, const std::string& text) {
  const Size size = parse_size(text, "--size", "texels");
  spec.width = size.width;
  spec.height = size.height;
}

}  // namespace reliefbench
