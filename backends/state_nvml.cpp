// NVIDIA's management library. Its prototypes are written out from its public API (nvml.h), so that nothing of it is
// needed to build.
#include <dlfcn.h>

#include <array>
#include <cstdint>

#include "backends/backend.h"
#include "backends/device_state.h"

namespace reliefbench {
namespace {

using NvmlReturn = int;
constexpr NvmlReturn kNvmlSuccess = 0;
using NvmlDevice = void*;
constexpr int kGraphicsClock = 0;   // NVML_CLOCK_GRAPHICS
constexpr int kGpuTemperature = 0;  // NVML_TEMPERATURE_GPU

/// nvmlClocksThrottleReason*; not those that say that nothing is to be done, or that somebody set the clock.
struct ReasonBit {
  std::uint64_t bit;
  std::string_view reason;
};
constexpr std::array kReasonBits = {
    ReasonBit{.bit = 0x04, .reason = kPowerCap},          // SwPowerCap
    ReasonBit{.bit = 0x08, .reason = kHardwareSlowdown},  // HwSlowdown
    ReasonBit{.bit = 0x20, .reason = kThermalSlowdown},   // SwThermalSlowdown
    ReasonBit{.bit = 0x40, .reason = kThermalSlowdown},   // HwThermalSlowdown
    ReasonBit{.bit = 0x80, .reason = kHardwareSlowdown},  // HwPowerBrakeSlowdown
};

/// The library, loaded and initialised.
class Nvml {
 public:
  explicit Nvml(const std::string& library) : library_(dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
    is_ready_ = call<>("nvmlInit_v2");
  }
  ~Nvml() {
    if (is_ready_) (void)call<>("nvmlShutdown");
    if (library_ != nullptr) dlclose(library_);
  }
  Nvml(const Nvml&) = delete;
  Nvml& operator=(const Nvml&) = delete;

  [[nodiscard]] bool is_ready() const { return is_ready_; }

  /// Whether the library has the function, and it succeeded.
  template <typename... Parameters>
  [[nodiscard]] bool call(const char* name, Parameters... arguments) const {
    if (library_ == nullptr) return false;
    auto* const function = reinterpret_cast<NvmlReturn (*)(Parameters...)>(dlsym(library_, name));
    return function != nullptr && function(arguments...) == kNvmlSuccess;
  }

 private:
  void* library_;
  bool is_ready_ = false;
};

class NvmlReader final : public StateReader {
 public:
  NvmlReader(const std::string& library, const std::string& pci) : nvml_(library) {
    is_found_ = nvml_.is_ready() &&
                nvml_.call<const char*, NvmlDevice*>("nvmlDeviceGetHandleByPciBusId_v2", pci.c_str(), &device_);
  }
  [[nodiscard]] bool is_found() const { return is_found_; }

  void read(DeviceState& state) override {
    enter_value(state, &DeviceState::clock_mhz, asked("nvmlDeviceGetClockInfo", kGraphicsClock));
    enter_value(state, &DeviceState::clock_max_mhz, asked("nvmlDeviceGetMaxClockInfo", kGraphicsClock));
    enter_value(state, &DeviceState::temperature_c, asked("nvmlDeviceGetTemperature", kGpuTemperature));
    unsigned milliwatts = 0;
    if (nvml_.call<NvmlDevice, unsigned*>("nvmlDeviceGetPowerUsage", device_, &milliwatts))
      enter_value(state, &DeviceState::power_w, milliwatts * 1e-3);
    unsigned long long bits = 0;
    if (nvml_.call<NvmlDevice, unsigned long long*>("nvmlDeviceGetCurrentClocksThrottleReasons", device_, &bits))
      for (const ReasonBit& row : kReasonBits)
        if ((bits & row.bit) != 0) state.held_back.emplace(row.reason);
  }

 private:
  [[nodiscard]] std::optional<double> asked(const char* name, int which) const {
    unsigned value = 0;
    if (!nvml_.call<NvmlDevice, int, unsigned*>(name, device_, which, &value)) return std::nullopt;
    return value;
  }

  Nvml nvml_;
  NvmlDevice device_ = nullptr;
  bool is_found_ = false;
};

}  // namespace

std::unique_ptr<StateReader> open_nvml(const DeviceInfo& device, const StatePlaces& places) {
  if (device.pci.empty()) return nullptr;
  auto reader = std::make_unique<NvmlReader>(places.nvml, device.pci);
  if (!reader->is_found()) return nullptr;
  return reader;
}

}  // namespace reliefbench
