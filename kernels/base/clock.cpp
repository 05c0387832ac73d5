#include "kernels/base/clock.h"

#include <fmt/chrono.h>

#include <algorithm>
#include <chrono>
#include <ctime>

namespace reliefbench {

double steady_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double unix_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string utc_text(double time_ns) {
  const double seconds = std::clamp(time_ns * 1e-9, kLeastUnixSeconds, kMostUnixSeconds - 1);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(static_cast<std::time_t>(seconds)));
}

}  // namespace reliefbench
