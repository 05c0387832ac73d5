#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

struct DeviceInfo;

// Why a driver holds a clock back. That nothing is to be done or that somebody set the clock is no such reason.
inline constexpr std::string_view kThermalSlowdown = "thermal slowdown";
inline constexpr std::string_view kPowerCap = "power cap";
inline constexpr std::string_view kHardwareSlowdown = "hardware slowdown";

/// What driver and system tell of a device at a moment; what they do not tell is not there.
struct DeviceState {
  std::optional<double> clock_mhz{};      ///< of the graphics engine; of a processor, its fastest core's
  std::optional<double> clock_max_mhz{};  ///< that it may have
  std::optional<double> temperature_c{};
  std::optional<double> power_w{};
  std::optional<double> throttle_events{};  ///< how often a processor was slowed down since the machine was started
  std::set<std::string, std::less<>> held_back{};  ///< why the clock is not higher: the reasons above

  bool operator==(const DeviceState&) const = default;
  [[nodiscard]] bool is_told() const { return *this != DeviceState{}; }
};

/// A number of a state: its name in files, and what it may be. What is read and is not, is no value.
struct StateQuantity {
  std::string_view id;
  std::optional<double> DeviceState::*value;
  double least;
  double greatest;
};
[[nodiscard]] std::span<const StateQuantity> state_quantities();
/// Enters the value, unless it is none or there is one already.
void enter_value(DeviceState& state, std::optional<double> DeviceState::*quantity, std::optional<double> value);

/// "thermal slowdown, 1005 of 1980 MHz, 88 C, 310 W": what is told of it; "" where nothing is.
[[nodiscard]] std::string state_text(const DeviceState& state);

/// Where states are looked for; tests have places of their own.
struct StatePlaces {
  std::filesystem::path sysfs = "/sys";
  std::string nvml = "libnvidia-ml.so.1";
};

/// One source's view of one device.
class StateReader {
 public:
  StateReader() = default;
  virtual ~StateReader() = default;
  StateReader(const StateReader&) = delete;
  StateReader& operator=(const StateReader&) = delete;
  /// Enters what is not there yet.
  virtual void read(DeviceState& state) = 0;
};

/// Who may know a device's state. Sources are asked in the order of their rows; the first that tells a value has it.
struct StateSource {
  std::string_view id;
  /// null: it knows nothing of this device
  std::unique_ptr<StateReader> (*open)(const DeviceInfo& device, const StatePlaces& places);
};
[[nodiscard]] std::span<const StateSource> state_sources();

// The sources behind the rows.
[[nodiscard]] std::unique_ptr<StateReader> open_nvml(const DeviceInfo& device, const StatePlaces& places);
[[nodiscard]] std::unique_ptr<StateReader> open_pci_files(const DeviceInfo& device, const StatePlaces& places);
[[nodiscard]] std::unique_ptr<StateReader> open_processor_files(const DeviceInfo& device, const StatePlaces& places);

/// A device's state, again and again: what takes long (libraries, folders) is opened once.
class DeviceWatch {
 public:
  explicit DeviceWatch(const DeviceInfo& device, const StatePlaces& places = {});
  [[nodiscard]] DeviceState read();

 private:
  std::vector<std::unique_ptr<StateReader>> readers_;
};

}  // namespace reliefbench
