#pragma once
#include <fstream>
#include <string>

#include "tests/own_cache.h"
#include "tests/synthetic_run.h"
#include "tests/temp_folder.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/config.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {

/// A synthetic run whose ok cases have samples: on a device that is steadily slowing down, and whose control case slows
/// down with it.
inline Run sampled_run(const SyntheticRunOptions& options) {
  Run run = synthetic_run(options);
  double at_ns = 0;
  const auto add = [&](const std::string& id, int round, double time_ns) {
    at_ns += 1e6;
    run.samples.push_back(
        {.case_id = id, .round = round, .frames = 3, .frame_time_ns = time_ns * (1 + at_ns * 1e-9), .at_ns = at_ns});
  };
  for (const Record& record : run.records) {
    if (record.status != Status::ok) continue;
    for (int round = 0; round < 3; ++round) {
      add(control_case_id(record.backend), 0, 812345);
      add(record.case_id, round, record.frame_time->summary.median * (0.99 + 0.01 * round));
    }
  }
  return run;
}

/// Sweeps 61 settings on the null backend: a real run folder, in no time.
inline std::filesystem::path null_sweep(const TempFolder& folder, const std::string& views = R"("oblique")") {
  const OwnCache cache(folder / "cache");
  std::ofstream(folder / "config.json") << R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 32, "height": 32}, "frame_px": [64, 64], "views": [)" +
                                               views + R"(]}],
    "measure": {"samples": 5, "batch_ms": 0.1, "warmup_batches_max": 1},
    "front": {"error": "e_xy.p95", "constraints": ["missed_rate<=0.5"]},
    "sweeps": [
      {"technique": "flat"},
      {"technique": "relief", "axes": {"linear_steps": {"from": 2, "to": 64, "times": 2}, "refinement": ["none", "secant", "binary"],
                                       "filter": ["hardware", "manual"]}},
      {"technique": "cone", "axes": {"cone_steps": {"from": 2, "to": 64, "times": 2}, "step": ["plain", "cell_quad"],
                                     "format": ["rg8", "rg16"]}}]})";
  const Config config = load_config(folder / "config.json");
  return run_sweep(config, {.output = folder / "run", .backends = {"null"}, .quiet = true}).folder;
}

}  // namespace reliefbench
