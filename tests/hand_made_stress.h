#pragma once
#include <filesystem>

#include "reports/pages/stress_page.h"
#include "tests/synthetic_run.h"

namespace reliefbench {

/// Two techniques at two extremes: one missed a quarter, one left out, one held, one that breaks its guarantee.
inline StressReport hand_made_stress() {
  StressReport report;
  report.techniques = {"flat", "cone"};
  report.extremes = {{.id = "cliff", .about = kHostileText, .scene = {}}, {.id = "deep", .about = "10", .scene = {}}};
  report.devices = {"null: device"};
  const auto add = [&](const std::string& technique, const std::string& extreme) -> StressResult& {
    return report.results.emplace_back(StressResult{.extreme = extreme,
                                                    .technique = technique,
                                                    .map = "height",
                                                    .format = "r8",
                                                    .settings = "filter=manual&loop=fixed",
                                                    .backend = "null",
                                                    .pixels = 64});
  };
  add("flat", "cliff").missed_rate = 0.25;
  add("flat", "deep").skipped = "needs --large";
  add("cone", "cliff").guarantee = Guarantee::exact;
  StressResult& broken = add("cone", "deep");
  broken.guarantee = Guarantee::exact;
  broken.fault(StressCheck::guarantee) = 3;
  broken.e_xy_p99 = 1.5;
  for (const StressResult& worst : {report.results.front(), report.results.back()})
    report.pictures.push_back({.technique = worst.technique,
                               .result = worst,
                               .rgba8 = std::vector<std::uint8_t>(2 * 2 * 4, 255),
                               .width = 2,
                               .height = 2});
  return report;
}

/// The folder that `stress` leaves of it.
inline std::filesystem::path write_hand_made_stress(const std::filesystem::path& folder) {
  const FolderLock lock = prepare_stress_folder(folder);
  write_stress(hand_made_stress(), folder);
  return folder;
}

}  // namespace reliefbench
