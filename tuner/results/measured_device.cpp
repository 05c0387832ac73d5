#include "tuner/results/measured_device.h"

#include <nlohmann/json.hpp>

#include "tuner/results/environment.h"

namespace reliefbench {

MeasuredDevice measured_device(const nlohmann::json& info, const std::string& backend, const std::string& device) {
  const Environment environment = measured_environment(info, backend);
  const bool is_software = trait(environment, "software") == "true";
  return {.backend = backend,
          .device = device,
          .driver = std::string(trait(environment, "driver")),
          .machine = is_software ? std::string(trait(environment, "CPU")) : std::string()};
}

}  // namespace reliefbench
