// An NVML of one device, at the PCI address and with the values that FAKE_NVML names: "0000:65:00.0 clock=1005 max=1980
// temperature=88 power=310000 reasons=0x44". What it does not name, the library refuses.
#include <cstdlib>
#include <sstream>
#include <string>

namespace {

constexpr int kNotSupported = 3;  // NVML_ERROR_NOT_SUPPORTED
constexpr int kNotFound = 6;      // NVML_ERROR_NOT_FOUND

std::string setting() {
  const char* const given = std::getenv("FAKE_NVML");
  return given == nullptr ? "" : given;
}

template <typename Number>
int give(const std::string& name, Number* into) {
  std::istringstream words(setting());
  for (std::string word; words >> word;)
    if (word.rfind(name + "=", 0) == 0) {
      *into = static_cast<Number>(std::stoull(word.substr(name.size() + 1), nullptr, 0));
      return 0;
    }
  return kNotSupported;
}

}  // namespace

extern "C" {

int nvmlInit_v2() { return setting().empty() ? kNotSupported : 0; }
int nvmlShutdown() { return 0; }
int nvmlDeviceGetHandleByPciBusId_v2(const char* address, void** device) {
  static int one = 0;
  *device = &one;
  return setting().rfind(std::string(address) + " ", 0) == 0 ? 0 : kNotFound;
}
int nvmlDeviceGetClockInfo(void* /*device*/, int /*type*/, unsigned* mhz) { return give("clock", mhz); }
int nvmlDeviceGetMaxClockInfo(void* /*device*/, int /*type*/, unsigned* mhz) { return give("max", mhz); }
int nvmlDeviceGetTemperature(void* /*device*/, int /*sensor*/, unsigned* degrees) {
  return give("temperature", degrees);
}
int nvmlDeviceGetPowerUsage(void* /*device*/, unsigned* milliwatts) { return give("power", milliwatts); }
int nvmlDeviceGetCurrentClocksThrottleReasons(void* /*device*/, unsigned long long* bits) {
  return give("reasons", bits);
}
}
