#include "kernels/base/clock.h"

#include <fmt/chrono.h>

#include <chrono>
#include <ctime>

namespace reliefbench {

double unix_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string utc_text(double time_ns) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(static_cast<std::time_t>(time_ns * 1e-9)));
}

}  // namespace reliefbench
