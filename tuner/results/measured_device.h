#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace reliefbench {

/// What a time is of, beside the setting and the scene.
struct MeasuredDevice {
  std::string backend;
  std::string device;
  std::string driver;   ///< "": a table of an earlier version does not say
  std::string machine;  ///< the processor's name where the device is software; else, and in such a table, ""
  friend bool operator==(const MeasuredDevice&, const MeasuredDevice&) = default;
};

/// info: run.json of the run that measured on it
[[nodiscard]] MeasuredDevice measured_device(const nlohmann::json& info, const std::string& backend,
                                             const std::string& device);

}  // namespace reliefbench
