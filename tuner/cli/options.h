#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "kernels/base/size.h"
#include "kernels/image/heightmap.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/config.h"
#include "tuner/results/record.h"

namespace reliefbench {

// Options are bound to members of what must outlive the parse. Those that are read from text throw Error(bad_input)
// while they are parsed.

/// A finite number, and nothing beside it; none: it is no such thing.
[[nodiscard]] std::optional<double> finite_number(std::string_view text);
/// Checks of an option's number. what: is expected, as in "a number above 0"; name: for the help
[[nodiscard]] CLI::Validator expect_number(const std::string& what, const std::function<bool(double)>& holds,
                                           const std::string& name = "");
[[nodiscard]] CLI::Validator above_zero();
[[nodiscard]] CLI::Validator not_below_zero();

/// Each time that it is given an option of a list takes one word: what follows may be a positional.
CLI::Option* take_each(CLI::Option* list);
/// Bounds on metrics, which may be given several times. bounds: a list, or none where the option is not given
template <typename Bounds>
CLI::Option* add_bounds_option(CLI::App& command, const std::string& name, Bounds& bounds, const std::string& words) {
  const auto read = [&bounds](const std::vector<std::string>& texts) {
    bounds = parse_budgets(texts);
    return true;
  };
  return command.add_option(name, read, words)->type_name("BOUND")->take_all();
}
/// --weights: numbers above 0 with commas between them.
void add_weights_option(CLI::App& command, std::vector<double>& weights, const std::string& words);

CLI::Option* add_json_option(CLI::App& command, bool& json);  ///< --json
void add_quiet_option(CLI::App& command, bool& quiet);        ///< --quiet
void add_device_option(CLI::App& command, int& device);       ///< --device

/// How a heightmap is read, as every command that takes one asks. What is not said stays as it is.
struct ReadingArguments {
  std::optional<std::string> channel{};
  std::optional<std::string> floor{};
  bool invert = false;
  bool normalise = false;
  std::string size{};
  std::optional<std::uint32_t> seed{};
};
/// Adds --channel, --floor, --invert and --normalise.
void add_channel_options(CLI::App& command, ReadingArguments& arguments);
/// Adds --channel, --floor, --invert, --normalise, --size and --seed.
void add_reading_options(CLI::App& command, ReadingArguments& arguments);
void set_reading(HeightmapSpec& spec, const ReadingArguments& arguments);  ///< throws: Error(bad_input): --size

/// "read rocks.png: 512x512, 16-bit grey (alpha ignored)" on stderr; nothing of a procedural heightmap.
void print_reading(const std::string& reading);
/// --inject-slowdown TECHNIQUE:FACTOR, as often as there are techniques.
void add_slowdown_option(CLI::App& command, Slowdowns& slowdowns);

/// --base; usual: what holds where it is not given.
void add_base_option(CLI::App& command, std::optional<double>& base, const std::string& usual);

/// "WIDTHxHEIGHT". option, unit: for the message. throws: Error(bad_input)
[[nodiscard]] Size parse_size(const std::string& text, std::string_view option, std::string_view unit);

/// The devices of that index on some backends.
[[nodiscard]] std::vector<DeviceInfo> chosen_devices(std::span<const std::string> backend_ids, int index);
/// --frame-px: "WIDTHxHEIGHT" or a name of kFrameSizes.
/// otherwise: what frames are without it, on hardware and on software rasterisers
void add_frame_option(CLI::App& command, std::optional<Size>& frame_px, std::string_view otherwise = {});

/// Of a --scene that is none of the known ones. owner: who has those, as in "the run", or several, as in "the runs"
/// throws: Error(bad_input)
[[noreturn]] void fail_scene(const std::string& scene, const std::set<std::string>& known, std::string_view owner,
                             bool are_several = false);
/// Ids of the scenes that records are of.
[[nodiscard]] std::set<std::string> scenes_of(std::span<const Record> records);

/// "WIDTHxHEIGHT" into the spec. throws: Error(bad_input)
void set_size(HeightmapSpec& spec, const std::string& text);

}  // namespace reliefbench
