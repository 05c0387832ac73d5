#include "backends/device_state.h"

#include <fmt/format.h>

#include <array>

namespace reliefbench {

std::span<const StateQuantity> state_quantities() {
  static constexpr std::array kRows = {
      StateQuantity{.id = "clock_mhz", .value = &DeviceState::clock_mhz, .least = 1, .greatest = 1e5},
      StateQuantity{.id = "clock_max_mhz", .value = &DeviceState::clock_max_mhz, .least = 1, .greatest = 1e5},
      StateQuantity{.id = "temperature_c", .value = &DeviceState::temperature_c, .least = 0, .greatest = 200},
      StateQuantity{.id = "power_w", .value = &DeviceState::power_w, .least = 0, .greatest = 1e4},
      StateQuantity{.id = "throttle_events", .value = &DeviceState::throttle_events, .least = 0, .greatest = 1e15},
  };
  return kRows;
}

void enter_value(DeviceState& state, std::optional<double> DeviceState::*quantity, std::optional<double> value) {
  if (!value || state.*quantity) return;
  for (const StateQuantity& row : state_quantities())
    if (row.value == quantity && *value >= row.least && *value <= row.greatest) state.*quantity = value;
}

std::string state_text(const DeviceState& state) {
  std::vector<std::string> parts(state.held_back.begin(), state.held_back.end());
  if (state.clock_mhz && state.clock_max_mhz)
    parts.push_back(fmt::format("{:.0f} of {:.0f} MHz", *state.clock_mhz, *state.clock_max_mhz));
  else if (state.clock_mhz)
    parts.push_back(fmt::format("{:.0f} MHz", *state.clock_mhz));
  else if (state.clock_max_mhz)
    parts.push_back(fmt::format("at most {:.0f} MHz", *state.clock_max_mhz));
  if (state.temperature_c) parts.push_back(fmt::format("{:.0f} C", *state.temperature_c));
  if (state.power_w) parts.push_back(fmt::format("{:.0f} W", *state.power_w));
  if (state.throttle_events && *state.throttle_events > 0)
    parts.push_back(fmt::format("slowed down {:.0f} times since the machine was started", *state.throttle_events));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::span<const StateSource> state_sources() {
  static constexpr std::array kRows = {
      StateSource{.id = "nvml", .open = open_nvml},
      StateSource{.id = "pci_files", .open = open_pci_files},
      StateSource{.id = "processor_files", .open = open_processor_files},
  };
  return kRows;
}

DeviceWatch::DeviceWatch(const DeviceInfo& device, const StatePlaces& places) {
  for (const StateSource& source : state_sources())
    if (auto reader = source.open(device, places)) readers_.push_back(std::move(reader));
}

DeviceState DeviceWatch::read() {
  DeviceState state;
  for (const auto& reader : readers_) reader->read(state);
  return state;
}

}  // namespace reliefbench
