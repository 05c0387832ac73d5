#include "tuner/results/device_json.h"

#include <nlohmann/json.hpp>

namespace reliefbench {

nlohmann::json device_json(const DeviceInfo& device) {
  nlohmann::json timers = nlohmann::json::array();
  for (const Timer timer : device.timers) timers.push_back(timer_id(timer));
  nlohmann::json j = {
      {"backend", device.backend},         {"index", device.index},       {"name", device.name},
      {"vendor", device.vendor},           {"type", device.type},         {"driver", device.driver},
      {"api_version", device.api_version}, {"software", device.software}, {"subtexel_bits", device.subtexel_bits},
      {"timers", std::move(timers)}};
  if (!device.pci.empty()) j["pci"] = device.pci;
  return j;
}

nlohmann::json device_of(const nlohmann::json& info, std::string_view backend) {
  for (const nlohmann::json& device : info.value("devices", nlohmann::json::array()))
    if (device.value("backend", "") == backend) return device;
  return nlohmann::json::object();
}

double control_reference_ns(const nlohmann::json& info, std::string_view backend) {
  return device_of(info, backend).value("control_reference_ns", 0.0);
}

nlohmann::json audit_json(std::span<const TimerAudit> audit) {
  nlohmann::json list = nlohmann::json::array();
  for (const TimerAudit& row : audit) {
    list.push_back({{"timer", timer_id(row.timer)},
                    {"valid", row.valid},
                    {"wall_ratio", row.wall_ratio},
                    {"doubling", row.doubling},
                    {"reason", row.reason}});
  }
  return list;
}

nlohmann::json filter_json(std::span<const FilterAudit> audit) {
  nlohmann::json list = nlohmann::json::array();
  for (const FilterAudit& row : audit) {
    if (!row.refusal.empty()) {
      list.push_back({{"texels", texel_type_id(row.type)}, {"refusal", row.refusal}});
      continue;
    }
    list.push_back({{"texels", texel_type_id(row.type)},
                    {"bits", row.precision.bits},
                    {"rounds", row.precision.rounds},
                    {"least", row.precision.least},
                    {"greatest", row.precision.greatest},
                    {"value", row.precision.value}});
  }
  return list;
}

FilterPrecision parse_filter_weights(const nlohmann::json& entry) {
  return {.least = entry.value("least", 0.0), .greatest = entry.value("greatest", 0.0)};
}

}  // namespace reliefbench
