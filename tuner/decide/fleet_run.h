#pragma once
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/case_table.h"
#include "tuner/results/measured_device.h"

namespace reliefbench {

/// A run of one of several devices: its folder or table.csv, and what it holds.
struct FleetRun {    // NOLINT(bugprone-exception-escape): moving a json does not throw
  std::string name;  ///< as it was given
  std::vector<TableRow> rows;
  double weight = 1;
  nlohmann::json info{};  ///< run.json; null of a table
};
[[nodiscard]] FleetRun fleet_run(const Run& run);
/// throws: Error(bad_input): neither a run's folder nor a table
[[nodiscard]] FleetRun load_fleet_run(const std::filesystem::path& path);

/// The budgets that all of the runs were made to meet.
/// throws: Error(bad_input): theirs differ
[[nodiscard]] std::vector<Budget> common_budgets(std::span<const FleetRun> runs);

/// "vulkan NVIDIA H200"; with the driver and the machine where another of `all` has the same name.
[[nodiscard]] std::string device_text(const MeasuredDevice& device, std::span<const MeasuredDevice> all);

/// Cases of a run whose samples are the very same in an earlier run: a copy, or a shard of a merged run.
struct RepeatedCases {
  std::size_t run = 0;      ///< index
  std::size_t earlier = 0;  ///< index; of several the first
  std::size_t cases = 0;
};

/// A device with a scene, and the runs that measured it.
struct MeasuredPlace {
  MeasuredDevice device;
  std::string scene;
  SceneKey scene_key{};
  std::vector<std::size_t> runs;                    ///< indices
  std::vector<std::vector<const TableRow*>> cases;  ///< of each of these runs; they point into its rows
  std::vector<RepeatedCases> repeated{};            ///< are not among the cases
};
/// Every place of the runs, in the order of their rows. Runs of one place share it, and a measurement that two of them
/// hold is the earlier one's alone.
[[nodiscard]] std::vector<MeasuredPlace> places_of(std::span<const FleetRun> runs);
/// For people, a line for each two runs: "b: 60 of its cases are the same measurement as in a and count once"
[[nodiscard]] std::vector<std::string> repeated_texts(std::span<const MeasuredPlace> places,
                                                      std::span<const FleetRun> runs);

}  // namespace reliefbench
