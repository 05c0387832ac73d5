#include "tuner/results/block_state.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <type_traits>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr const char* kHeldBack = "held_back";

template <typename T>
T entry_of(const json& j, const char* key) {
  try {
    const json& value = j.at(key);
    if (std::is_integral_v<T> ? value.is_number_integer() : !std::is_arithmetic_v<T> || value.is_number())
      return value.get<T>();
    fail_input("'{}' is not a number", key);
  } catch (const json::exception&) {
    fail_input("'{}' is missing, or not what it should be", key);
  }
}

DeviceState state_in(const json& j, const char* key) { return j.contains(key) ? parse_state(j[key]) : DeviceState{}; }

json states_json(std::span<const BlockState> blocks, const std::string& backend) {
  int count = 0;
  int held_back = 0;
  std::set<std::string> reasons;
  json states = json::object();
  for (const BlockState& block : blocks) {
    if (block.backend != backend) continue;
    ++count;
    held_back += block.held_back.empty() ? 0 : 1;
    for (const DeviceState* state : {&block.before, &block.after}) {
      reasons.insert(state->held_back.begin(), state->held_back.end());
      for (const StateQuantity& row : state_quantities()) {
        const std::optional<double>& value = state->*row.value;
        if (!value) continue;
        json& range = states[std::string(row.id)];
        if (range.is_null()) range = {*value, *value};
        range[0] = std::min(range[0].get<double>(), *value);
        range[1] = std::max(range[1].get<double>(), *value);
      }
    }
  }
  if (count == 0) return nullptr;
  states["blocks"] = count;
  if (held_back > 0) states["blocks_held_back"] = held_back;
  if (!reasons.empty()) states[kHeldBack] = reasons;
  return states;
}

}  // namespace

json state_json(const DeviceState& state) {
  json j = json::object();
  for (const StateQuantity& row : state_quantities())
    if (state.*row.value) j[std::string(row.id)] = *(state.*row.value);
  if (!state.held_back.empty()) j[kHeldBack] = state.held_back;
  return j;
}

DeviceState parse_state(const json& j) {
  if (!j.is_object()) fail_input("a device's state is not an object");
  DeviceState state;
  for (const StateQuantity& row : state_quantities())
    if (const std::string id(row.id); j.contains(id)) enter_value(state, row.value, entry_of<double>(j, id.c_str()));
  if (j.contains(kHeldBack))
    for (std::string& reason : entry_of<std::vector<std::string>>(j, kHeldBack))
      state.held_back.insert(std::move(reason));
  return state;
}

void to_json(json& j, const BlockState& block) {
  j = {{"backend", block.backend}, {"from_ns", block.from_ns}, {"to_ns", block.to_ns}};
  if (block.part != 0) j["part"] = block.part;
  if (block.before.is_told()) j["before"] = state_json(block.before);
  if (block.after.is_told()) j["after"] = state_json(block.after);
  if (!block.held_back.empty()) j[kHeldBack] = block.held_back;
}

void from_json(const json& j, BlockState& block) {
  if (!j.is_object()) fail_input("expected an object that holds 'backend'");
  block = {.backend = entry_of<std::string>(j, "backend"),
           .from_ns = entry_of<double>(j, "from_ns"),
           .to_ns = entry_of<double>(j, "to_ns"),
           .part = j.contains("part") ? entry_of<int>(j, "part") : 0,
           .before = state_in(j, "before"),
           .after = state_in(j, "after"),
           .held_back = j.contains(kHeldBack) ? entry_of<std::string>(j, kHeldBack) : ""};
}

void keep_counting(std::vector<Sample>& samples, std::span<const BlockState> blocks) {
  for (const BlockState& block : blocks)
    if (!block.held_back.empty()) std::erase_if(samples, [&](const Sample& sample) { return block.has(sample); });
}

void set_states(std::span<json> devices, std::span<const BlockState> blocks) {
  for (json& device : devices) {
    device.erase("states");
    if (json states = states_json(blocks, device.value("backend", "")); !states.is_null())
      device["states"] = std::move(states);
  }
}

}  // namespace reliefbench
