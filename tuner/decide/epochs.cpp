#include "tuner/decide/epochs.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tuner/history/series_name.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// Whether two environments differ in nothing but a step of the processor's clock, which Google Benchmark measures and
/// which is stored in hundreds of MHz: near the middle of two it goes up once and down once.
bool is_a_step_of_the_clock(json a, json b) {
  constexpr const char* kClock = "mhz_per_cpu";
  constexpr double kStep = 100;
  for (const json* environment : {&a, &b})
    if (!environment->contains(kClock) || !environment->at(kClock).is_number()) return false;
  if (std::abs(a[kClock].get<double>() - b[kClock].get<double>()) > kStep) return false;
  a.erase(kClock);
  b.erase(kClock);
  return a == b;
}

/// What of an environment is a device's: all but the other devices. The whole of one that does not list it.
json environment_of_device(json environment, const std::string& device) {
  const auto devices = environment.find("devices");
  if (devices == environment.end()) return environment;
  for (const json& entry : *devices) {
    if (device_name(entry.value("backend", ""), entry.value("name", "")) != device) continue;
    environment["devices"] = json::array({entry});
    return environment;
  }
  return environment;
}

/// The environments of a view's runs, by device.
class Environments {
 public:
  explicit Environments(const HistoryView& view) {
    for (const EnvironmentRow& row : view.environments) contents_.emplace(row.id, row.content);
  }
  [[nodiscard]] bool are_same(std::int64_t a, std::int64_t b, const std::string& device) {
    if (a == b) return true;
    const auto [known, is_new] = same_.try_emplace({a, b, device}, false);
    if (!is_new) return known->second;
    const auto first = contents_.find(a);
    const auto second = contents_.find(b);
    if (first == contents_.end() || second == contents_.end()) return false;
    const json one = environment_of_device(first->second, device);
    const json other = environment_of_device(second->second, device);
    return known->second = one == other || is_a_step_of_the_clock(one, other);
  }

 private:
  std::map<std::int64_t, json> contents_;
  std::map<std::tuple<std::int64_t, std::int64_t, std::string>, bool> same_;
};

/// The devices of each run, their epochs yet unset.
std::vector<std::map<std::string, std::size_t>> devices_of_runs(const HistoryView& view) {
  std::map<std::int64_t, std::size_t> places;
  std::vector<std::map<std::string, std::size_t>> devices(view.runs.size());
  for (std::size_t run = 0; run < view.runs.size(); ++run) {
    places[view.runs[run].id] = run;
    for (const CalibrationRow& control : view.runs[run].calibrations) devices[run][control.device] = 0;
  }
  for (std::size_t s = 0; s < view.series.size(); ++s)
    for (const RepetitionRow& night : view.nights[s]) devices[places.at(night.run)][view.series[s].device] = 0;
  return devices;
}

}  // namespace

Epochs::Epochs(const HistoryView& view) : begins_(devices_of_runs(view)), of_machines_(view.runs.size()) {
  struct Device {
    std::vector<std::size_t> begins;  ///< of its epochs
    std::size_t last = 0;             ///< begin of the one that it was in last
  };
  Environments environments(view);
  std::map<std::string, std::map<std::string, Device>> machines;
  std::map<std::string, std::size_t> last_of_machines;
  for (std::size_t run = 0; run < view.runs.size(); ++run) {
    const RunRow& row = view.runs[run];
    bool is_another = false;
    for (auto& [name, begin] : begins_[run]) {
      Device& device = machines[row.machine][name];
      const auto is_its = [&, &device_id = name](std::size_t first) {
        return environments.are_same(view.runs[first].environment, row.environment, device_id);
      };
      const auto known = std::ranges::find_if(device.begins, is_its);
      const bool is_new = known == device.begins.end();
      begin = is_new ? run : *known;
      is_another |= !device.begins.empty() && device.last != begin;
      if (is_new) device.begins.push_back(run);
      device.last = begin;
    }
    of_machines_[run] = last_of_machines[row.machine] += is_another ? 1 : 0;
  }
}

}  // namespace reliefbench
