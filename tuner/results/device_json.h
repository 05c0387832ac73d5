#pragma once
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>

#include "backends/filter_audit.h"
#include "backends/timer_audit.h"

namespace reliefbench {

/// A device as run.json and `reliefbench devices --json` give it, without audit.
[[nodiscard]] nlohmann::json device_json(const DeviceInfo& device);

/// The first entry of a backend in "devices" of run.json, of its identity or of a part; {} where none is.
[[nodiscard]] nlohmann::json device_of(const nlohmann::json& info, std::string_view backend);
/// The control case's time there when the run or part began, ns; 0 where it is not told.
[[nodiscard]] double control_reference_ns(const nlohmann::json& info, std::string_view backend);

/// [{"timer", "valid", "wall_ratio", "doubling", "reason"}]
[[nodiscard]] nlohmann::json audit_json(std::span<const TimerAudit> audit);

/// [{"texels", "bits", "rounds", "least", "greatest"}]; of texels that the device does not filter {"texels", "refusal"}
[[nodiscard]] nlohmann::json filter_json(std::span<const FilterAudit> audit);
/// Weights as such an entry has them; exact of one that has none.
[[nodiscard]] FilterPrecision parse_filter_weights(const nlohmann::json& entry);

}  // namespace reliefbench
