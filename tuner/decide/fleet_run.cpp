#include "tuner/decide/fleet_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "kernels/base/error.h"
#include "tuner/decide/environment.h"
#include "tuner/results/run_question.h"

namespace reliefbench {

FleetRun fleet_run(const Run& run) { return {.name = run.folder.string(), .rows = case_table(run), .info = run.info}; }

FleetRun load_fleet_run(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) return {.name = path.string(), .rows = load_case_table(path)};
  return fleet_run(load_run(path));
}

std::vector<Budget> common_budgets(std::span<const FleetRun> runs) {
  std::vector<Budget> budgets;
  for (const FleetRun& run : runs) {
    std::vector<Budget> own = question_of(run.info).budgets;
    if (&run == runs.data())
      budgets = std::move(own);
    else if (budget_texts(own) != budget_texts(budgets))
      fail_input("{} and {} have other budgets; say which hold by --max-error", runs.front().name, run.name);
  }
  return budgets;
}

MeasuredDevice measured_device(const nlohmann::json& info, const std::string& backend, const std::string& device) {
  const Environment environment = measured_environment(info, backend);
  const bool is_software = trait(environment, "software") == "true";
  return {.backend = backend,
          .device = device,
          .driver = std::string(trait(environment, "driver")),
          .machine = is_software ? std::string(trait(environment, "CPU")) : std::string()};
}

std::string device_text(const MeasuredDevice& device, std::span<const MeasuredDevice> all) {
  std::string text = fmt::format("{} {}", device.backend, device.device);
  const auto same_name = [&](const MeasuredDevice& other) {
    return other.backend == device.backend && other.device == device.device;
  };
  const auto differs = [&](auto member) {
    return std::ranges::any_of(
        all, [&](const MeasuredDevice& other) { return same_name(other) && other.*member != device.*member; });
  };
  if (differs(&MeasuredDevice::driver))
    text += fmt::format(" ({})", device.driver.empty() ? "driver not recorded" : device.driver);
  if (differs(&MeasuredDevice::machine))
    text += fmt::format(" on {}", device.machine.empty() ? "a machine not recorded" : device.machine);
  return text;
}

std::vector<MeasuredPlace> places_of(std::span<const FleetRun> runs) {
  std::vector<MeasuredPlace> places;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const TableRow* before = nullptr;
    std::size_t index = 0;
    for (const TableRow& row : runs[i].rows) {
      const bool goes_on = before != nullptr && before->backend == row.backend && before->device == row.device &&
                           before->scene == row.scene && before->scene_key == row.scene_key;
      before = &row;
      if (!goes_on) {
        const MeasuredDevice device = measured_device(runs[i].info, row.backend, row.device);
        const auto is_it = [&](const MeasuredPlace& place) {
          return place.device == device && place.scene_key == row.scene_key && place.scene == row.scene;
        };
        index = static_cast<std::size_t>(std::ranges::find_if(places, is_it) - places.begin());
        if (index == places.size())
          places.push_back({.device = device, .scene = row.scene, .scene_key = row.scene_key, .runs = {}, .cases = {}});
      }
      MeasuredPlace& place = places[index];
      if (place.runs.empty() || place.runs.back() != i) {
        place.runs.push_back(i);
        place.cases.emplace_back();
      }
      place.cases.back().push_back(&row);
    }
  }
  return places;
}

}  // namespace reliefbench
