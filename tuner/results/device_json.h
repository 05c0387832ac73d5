#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "backends/filter_audit.h"
#include "backends/timer_audit.h"

namespace reliefbench {

/// A device as run.json and `reliefbench devices --json` give it, without audit.
[[nodiscard]] nlohmann::json device_json(const DeviceInfo& device);

/// [{"timer", "valid", "wall_ratio", "doubling", "reason"}]
[[nodiscard]] nlohmann::json audit_json(std::span<const TimerAudit> audit);

/// [{"texels", "bits", "rounds", "least", "greatest"}]
[[nodiscard]] nlohmann::json filter_json(std::span<const FilterAudit> audit);

}  // namespace reliefbench
