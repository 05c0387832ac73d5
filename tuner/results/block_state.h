#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "backends/device_state.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// What is told of a state; {} where nothing is.
[[nodiscard]] nlohmann::json state_json(const DeviceState& state);
[[nodiscard]] DeviceState parse_state(const nlohmann::json& j);  ///< throws: Error(bad_input)

/// One line of blocks.jsonl: samples that were drawn together, with the device's state before and after them.
struct BlockState {
  std::string backend;
  double from_ns = 0;  ///< its samples are those of from < Sample::at_ns <= to
  double to_ns = 0;
  int part = 0;  ///< Sample::part
  DeviceState before{};
  DeviceState after{};
  std::string held_back{};  ///< what says that the device was: then its samples do not count; "": they do

  [[nodiscard]] bool has(const Sample& sample) const {
    return sample.part == part && from_ns < sample.at_ns && sample.at_ns <= to_ns;
  }
};
void to_json(nlohmann::json& j, const BlockState& block);
void from_json(const nlohmann::json& j, BlockState& block);  ///< throws: Error(bad_input)

/// Leaves out the samples of blocks that were held back.
void keep_counting(std::vector<Sample>& samples, std::span<const BlockState> blocks);

/// Gives each device of run.json its "states": how many blocks it had, how many of them did not count, the driver's
/// reasons, and of every quantity the least and greatest value. No such member where nothing was told.
void set_states(std::span<nlohmann::json> devices, std::span<const BlockState> blocks);

}  // namespace reliefbench
