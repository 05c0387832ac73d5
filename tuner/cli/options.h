#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "kernels/base/size.h"
#include "kernels/image/heightmap.h"
#include "tuner/measure/timing.h"

namespace reliefbench {

/// An option's value, or the fallback where it was not given.
template <typename T>
[[nodiscard]] T value_or(const CLI::Option* option, T fallback) {
  return option->empty() ? fallback : option->as<T>();
}

/// A flag, for is_set(). As std::string, since CLI11's overloads for bound variables compete for a literal description.
inline CLI::Option* add_switch(CLI::App& command, const std::string& name, const std::string& description) {
  return command.add_flag(name, description)->take_last();
}

/// Whether a flag was given, and not as --flag=false.
[[nodiscard]] inline bool is_set(const CLI::Option* flag) { return !flag->empty() && flag->as<bool>(); }

/// A finite number, and nothing beside it; none: it is no such thing.
[[nodiscard]] std::optional<double> finite_number(std::string_view text);
/// Checks of an option's number.
[[nodiscard]] CLI::Validator above_zero();
[[nodiscard]] CLI::Validator not_below_zero();

/// How a heightmap is read, as every command that takes one asks. What is not said stays as it is.
struct ReadingArguments {
  std::optional<std::string> channel{};
  std::optional<std::string> floor{};
  bool invert = false;
  bool normalise = false;
  std::string size{};
  std::optional<std::uint32_t> seed{};
};
/// Adds --channel, --floor, --invert and --normalise; `arguments` must outlive the parse.
void add_channel_options(CLI::App& command, ReadingArguments& arguments);
/// Adds --channel, --floor, --invert, --normalise, --size and --seed; `arguments` must outlive the parse.
void add_reading_options(CLI::App& command, ReadingArguments& arguments);
void set_reading(HeightmapSpec& spec, const ReadingArguments& arguments);  ///< throws: Error(bad_input): --size

/// "read rocks.png: 512x512, 16-bit grey (alpha ignored)" on stderr; nothing of a procedural heightmap.
void print_reading(const std::string& reading);
/// --inject-slowdown TECHNIQUE:FACTOR, as often as there are techniques.
[[nodiscard]] CLI::Option* add_slowdown_option(CLI::App& command);
[[nodiscard]] Slowdowns slowdowns_of(const CLI::Option* option);  ///< throws: Error(bad_input)

/// --base; usual: what holds where it is not given. `base` must outlive the parse.
void add_base_option(CLI::App& command, std::optional<double>& base, const std::string& usual);

/// "WIDTHxHEIGHT". option, unit: for the message. throws: Error(bad_input)
[[nodiscard]] Size parse_size(const std::string& text, std::string_view option, std::string_view unit);

/// The devices of that index on some backends.
[[nodiscard]] std::vector<DeviceInfo> chosen_devices(std::span<const std::string> backend_ids, int index);
/// --frame-px, for parse_frame_px(). otherwise: what frames are without it, on hardware and on software rasterisers
[[nodiscard]] CLI::Option* add_frame_option(CLI::App& command, std::string_view otherwise = {});
/// "WIDTHxHEIGHT" or a name of kFrameSizes. throws: Error(bad_input)
[[nodiscard]] Size parse_frame_px(const std::string& text);

/// "WIDTHxHEIGHT" into the spec. throws: Error(bad_input)
void set_size(HeightmapSpec& spec, const std::string& text);

}  // namespace reliefbench
